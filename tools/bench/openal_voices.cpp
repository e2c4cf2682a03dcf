#include "tools/bench/openal_voices.h"

#ifdef CLAMOR_HAS_OPENAL

#include <cmath>

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>

namespace clamor {

namespace {

constexpr int kRate_hz = 48000;

// A loopback device of stereo floats with a context of its own, which is the current one.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() {
    alcMakeContextCurrent(nullptr);
    if (context_ != nullptr) alcDestroyContext(context_);
    if (device_ != nullptr) alcCloseDevice(device_);
  }

  // `hrtf` is ALC_TRUE, ALC_FALSE, or ALC_DONT_CARE_SOFT for the library's default.
  bool open(std::size_t sources, ALCint hrtf) {
    const auto open_device = reinterpret_cast<LPALCLOOPBACKOPENDEVICESOFT>(
        alcGetProcAddress(nullptr, "alcLoopbackOpenDeviceSOFT"));
    if (open_device == nullptr) return false;
    device_ = open_device(nullptr);
    const ALCint wanted[] = {ALC_FORMAT_CHANNELS_SOFT,
                             ALC_STEREO_SOFT,
                             ALC_FORMAT_TYPE_SOFT,
                             ALC_FLOAT_SOFT,
                             ALC_FREQUENCY,
                             kRate_hz,
                             ALC_MONO_SOURCES,
                             static_cast<ALCint>(sources),
                             ALC_HRTF_SOFT,
                             hrtf,
                             0};
    if (device_ != nullptr) context_ = alcCreateContext(device_, wanted);
    return context_ != nullptr && alcMakeContextCurrent(context_) == ALC_TRUE;
  }

  ALCdevice* device() const { return device_; }
  ALCcontext* context() const { return context_; }
  ALCint value(ALCenum of) const {
    ALCint value = 0;
    alcGetIntegerv(device_, of, 1, &value);
    return value;
  }

 private:
  ALCdevice* device_ = nullptr;
  ALCcontext* context_ = nullptr;
};

class Loopback final : public OpenalVoices {
 public:
  bool open(const std::vector<std::vector<float>>& signals, const std::vector<Voice>& voices,
            bool hrtf) {
    render_ = reinterpret_cast<LPALCRENDERSAMPLESSOFT>(
        alcGetProcAddress(nullptr, "alcRenderSamplesSOFT"));
    if (render_ == nullptr || !device_.open(voices.size(), hrtf ? ALC_TRUE : ALC_FALSE))
      return false;
    // A user's alsoft.conf can require an HRTF or forbid it.
    if ((device_.value(ALC_HRTF_SOFT) == ALC_TRUE) != hrtf) return false;
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
  }

  void move(const std::vector<Voice>& voices) override {
    alcSuspendContext(device_.context());  // applies all changes at once
    for (std::size_t i = 0; i < voices.size(); ++i) {
      const float right = voices[i].right;
      alSourcef(sources_[i], AL_PITCH, voices[i].pitch);
      alSource3f(sources_[i], AL_POSITION, right, 0, -std::sqrt(1 - right * right));
    }
    alcProcessContext(device_.context());
  }

  void render(std::span<float> interleaved) override {
    render_(device_.device(), interleaved.data(), static_cast<ALCsizei>(interleaved.size() / 2));
  }

  std::string head() const override {
    return device_.value(ALC_HRTF_SOFT) == ALC_TRUE
               ? alcGetString(device_.device(), ALC_HRTF_SPECIFIER_SOFT)
               : "";
  }

 private:
  Device device_;
  LPALCRENDERSAMPLESSOFT render_ = nullptr;
  std::vector<ALuint> buffers_, sources_;
};

std::string hrtf_status(ALCint status) {
  switch (status) {
    case ALC_HRTF_DISABLED_SOFT:
      return "disabled";
    case ALC_HRTF_ENABLED_SOFT:
      return "enabled";
    case ALC_HRTF_DENIED_SOFT:
      return "denied";
    case ALC_HRTF_REQUIRED_SOFT:
      return "required";
    case ALC_HRTF_HEADPHONES_DETECTED_SOFT:
      return "headphones detected";
    default:
      return "unsupported";
  }
}

std::string default_resampler() {
  const auto string_of = reinterpret_cast<LPALGETSTRINGISOFT>(alGetProcAddress("alGetStringiSOFT"));
  if (string_of == nullptr || alIsExtensionPresent("AL_SOFT_source_resampler") == AL_FALSE)
    return "unknown";
  ALuint source = 0;
  ALint resampler = 0;
  alGenSources(1, &source);
  alGetSourcei(source, AL_SOURCE_RESAMPLER_SOFT, &resampler);
  alDeleteSources(1, &source);
  return string_of(AL_RESAMPLER_NAME_SOFT, resampler);
}

}  // namespace

std::unique_ptr<OpenalVoices> OpenalVoices::create(const std::vector<std::vector<float>>& signals,
                                                   const std::vector<Voice>& voices,
                                                   OpenalOutput output) {
  auto loopback = std::make_unique<Loopback>();
  if (!loopback->open(signals, voices, output == OpenalOutput::kBinaural)) return nullptr;
  return loopback;
}

OpenalLibrary openal_library() {
  Device device;
  if (!device.open(1, ALC_DONT_CARE_SOFT)) return {};
  const std::string version = alGetString(AL_VERSION);  // such as "1.1 ALSOFT 1.19.1"
  return {version.substr(version.rfind(' ') + 1), default_resampler(), device.value(ALC_FREQUENCY),
          hrtf_status(device.value(ALC_HRTF_STATUS_SOFT))};
}

}  // namespace clamor

#else  // CLAMOR_HAS_OPENAL

namespace clamor {

std::unique_ptr<OpenalVoices> OpenalVoices::create(const std::vector<std::vector<float>>&,
                                                   const std::vector<Voice>&, OpenalOutput) {
  return nullptr;
}

OpenalLibrary openal_library() { return {}; }

}  // namespace clamor

#endif  // CLAMOR_HAS_OPENAL
