#include "tools/bench/openal_voices.h"

#ifdef CLAMOR_HAS_OPENAL

#include <cmath>

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>

namespace clamor {

namespace {

constexpr int kRate_hz = 48000;

class Loopback final : public OpenalVoices {
 public:
  bool open(const std::vector<std::vector<float>>& signals, const std::vector<Voice>& voices) {
    const auto open_device = reinterpret_cast<LPALCLOOPBACKOPENDEVICESOFT>(
        alcGetProcAddress(nullptr, "alcLoopbackOpenDeviceSOFT"));
    render_ = reinterpret_cast<LPALCRENDERSAMPLESSOFT>(
        alcGetProcAddress(nullptr, "alcRenderSamplesSOFT"));
    if (open_device == nullptr || render_ == nullptr) return false;
    device_ = open_device(nullptr);
    const ALCint wanted[] = {ALC_FORMAT_CHANNELS_SOFT,
                             ALC_STEREO_SOFT,
                             ALC_FORMAT_TYPE_SOFT,
                             ALC_FLOAT_SOFT,
                             ALC_FREQUENCY,
                             kRate_hz,
                             ALC_MONO_SOURCES,
                             static_cast<ALCint>(voices.size()),
                             ALC_HRTF_SOFT,
                             ALC_FALSE,
                             0};
    if (device_ != nullptr) context_ = alcCreateContext(device_, wanted);
    if (context_ == nullptr || alcMakeContextCurrent(context_) == ALC_FALSE) return false;
    alDistanceModel(AL_NONE);
    buffers_.resize(signals.size());
    alGenBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
    const ALenum mono_float = alGetEnumValue("AL_FORMAT_MONO_FLOAT32");
    for (std::size_t i = 0; i < signals.size(); ++i)
      alBufferData(buffers_[i], mono_float, signals[i].data(),
                   static_cast<ALsizei>(signals[i].size() * sizeof(float)), kRate_hz);
    sources_.resize(voices.size());
    alGetError();
    alGenSources(static_cast<ALsizei>(sources_.size()), sources_.data());
    if (alGetError() != AL_NO_ERROR) {
      sources_.clear();
      return false;
    }
    for (std::size_t i = 0; i < voices.size(); ++i) {
      alSourcei(sources_[i], AL_BUFFER, static_cast<ALint>(buffers_[voices[i].signal]));
      alSourcei(sources_[i], AL_LOOPING, AL_TRUE);
      alSourcef(sources_[i], AL_GAIN, 1 / static_cast<float>(voices.size()));
      alSourcei(sources_[i], AL_SAMPLE_OFFSET, voices[i].start_frame);
    }
    move(voices);
    alSourcePlayv(static_cast<ALsizei>(sources_.size()), sources_.data());
    return alGetError() == AL_NO_ERROR;
  }

  ~Loopback() override {
    if (!sources_.empty()) alDeleteSources(static_cast<ALsizei>(sources_.size()), sources_.data());
    if (!buffers_.empty()) alDeleteBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
    alcMakeContextCurrent(nullptr);
    if (context_ != nullptr) alcDestroyContext(context_);
    if (device_ != nullptr) alcCloseDevice(device_);
  }

  void move(const std::vector<Voice>& voices) override {
    alcSuspendContext(context_);  // applies all changes at once
    for (std::size_t i = 0; i < voices.size(); ++i) {
      const float right = voices[i].right;
      alSourcef(sources_[i], AL_PITCH, voices[i].pitch);
      alSource3f(sources_[i], AL_POSITION, right, 0, -std::sqrt(1 - right * right));
    }
    alcProcessContext(context_);
  }

  void render(std::span<float> interleaved) override {
    render_(device_, interleaved.data(), static_cast<ALCsizei>(interleaved.size() / 2));
  }

  // The last word of "1.1 ALSOFT 1.19.1".
  std::string version() const override {
    const std::string text = alGetString(AL_VERSION);
    return text.substr(text.rfind(' ') + 1);
  }

 private:
  LPALCRENDERSAMPLESSOFT render_ = nullptr;
  ALCdevice* device_ = nullptr;
  ALCcontext* context_ = nullptr;
  std::vector<ALuint> buffers_, sources_;
};

}  // namespace

std::unique_ptr<OpenalVoices> OpenalVoices::create(const std::vector<std::vector<float>>& signals,
                                                   const std::vector<Voice>& voices) {
  auto loopback = std::make_unique<Loopback>();
  if (!loopback->open(signals, voices)) return nullptr;
  return loopback;
}

}  // namespace clamor

#else  // CLAMOR_HAS_OPENAL

namespace clamor {

std::unique_ptr<OpenalVoices> OpenalVoices::create(const std::vector<std::vector<float>>&,
                                                   const std::vector<Voice>&) {
  return nullptr;
}

}  // namespace clamor

#endif  // CLAMOR_HAS_OPENAL
