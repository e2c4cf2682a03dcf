#include "formats/wav_writer.h"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/random.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMostWav_bytes = 0xffff0000;  // WAV counts in 32 bits
constexpr int kMostFlacChannels = 8;
constexpr std::uint64_t kDitherSeed = 0x0d17'4e72;

struct Kind {
  SampleFormat format;
  const char* name;
  int bits;
  int subtype;  // libsndfile's
};
constexpr Kind kKinds[] = {{SampleFormat::kFloat32, "float", 32, SF_FORMAT_FLOAT},
                           {SampleFormat::kPcm32, "32", 32, SF_FORMAT_PCM_32},
                           {SampleFormat::kPcm24, "24", 24, SF_FORMAT_PCM_24},
                           {SampleFormat::kPcm16, "16", 16, SF_FORMAT_PCM_16}};

const Kind& kind_of(SampleFormat format) {
  return *std::ranges::find(kKinds, format, &Kind::format);
}

bool ends_in(const std::string& path, std::string_view wanted) {
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending == wanted;
}

bool is_flac(const std::string& path) { return ends_in(path, ".flac"); }

Result<void> check_flac(const std::string& path, const Kind& kind) {
  if (!is_flac(path) || kind.bits == 24 || kind.bits == 16) return {};
  return Error(fmt::format("{}: FLAC holds 16 or 24 bits, not {}; ask for 24 or write a .wav file",
                           path, kind.name));
}

// libsndfile's name of a bit of the channel mask.
int channel_map_of(Speaker speaker) {
  switch (speaker) {
    case Speaker::kFrontLeft:
      return SF_CHANNEL_MAP_LEFT;
    case Speaker::kFrontRight:
      return SF_CHANNEL_MAP_RIGHT;
    case Speaker::kFrontCentre:
      return SF_CHANNEL_MAP_CENTER;
    case Speaker::kLowFrequency:
      return SF_CHANNEL_MAP_LFE;
    case Speaker::kBackLeft:
      return SF_CHANNEL_MAP_REAR_LEFT;
    case Speaker::kBackRight:
      return SF_CHANNEL_MAP_REAR_RIGHT;
    case Speaker::kSideLeft:
      return SF_CHANNEL_MAP_SIDE_LEFT;
    case Speaker::kSideRight:
      return SF_CHANNEL_MAP_SIDE_RIGHT;
    case Speaker::kTopFrontLeft:
      return SF_CHANNEL_MAP_TOP_FRONT_LEFT;
    case Speaker::kTopFrontRight:
      return SF_CHANNEL_MAP_TOP_FRONT_RIGHT;
    case Speaker::kTopBackLeft:
      return SF_CHANNEL_MAP_TOP_REAR_LEFT;
    case Speaker::kTopBackRight:
      return SF_CHANNEL_MAP_TOP_REAR_RIGHT;
  }
  return SF_CHANNEL_MAP_INVALID;
}

// -1 to 1, most often near 0: one step of dither, from two uniform numbers.
double triangular(std::uint64_t frame, std::uint32_t channel) {
  const RandomBits bits = philox(
      kDitherSeed,
      {static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32), channel, 0});
  return unit(bits[0]) - unit(bits[1]);
}

}  // namespace

Result<void> check_sound_file(const std::string& path, int channels) {
  if (is_flac(path) && channels > kMostFlacChannels)
    return Error(fmt::format("{}: FLAC holds at most {} channels, not {}; write a .wav file.", path,
                             kMostFlacChannels, channels));
  if (is_flac(path) || ends_in(path, ".wav")) return {};
  return Error("cannot write " + in_quotes(path) +
               ": sound files end in .wav or .flac, which says what they are.");
}

Result<SampleFormat> sample_format(std::string_view name, const std::string& path) {
  if (name.empty()) return is_flac(path) ? SampleFormat::kPcm24 : SampleFormat::kFloat32;
  for (const Kind& kind : kKinds) {
    if (name != kind.name) continue;
    if (const auto right = check_flac(path, kind); !right.ok()) return right.error();
    return kind.format;
  }
  return Error("samples are written as float, 32, 24 or 16, not " + in_quotes(name));
}

struct WavWriter::State {
  std::string path, temporary;
  int descriptor = -1;
  SNDFILE* sound = nullptr;
  std::size_t channels = 0;
  SampleFormat format = SampleFormat::kFloat32;
  bool flac = false;
  std::uint64_t bytes = 0, frames = 0;
  std::vector<int> whole;  // samples of one write, with the highest bit at the top

  ~State() {
    if (sound != nullptr) sf_close(sound);
    if (descriptor >= 0) ::close(descriptor);
    if (!temporary.empty()) ::unlink(temporary.c_str());
  }

  Error failed(const std::string& what) const {
    return Error(path + ": cannot be written: " + what +
                 ". Check the folder, its rights and the space left.");
  }

  // Rounds samples to whole numbers, which libsndfile then only shifts.
  void quantise(std::span<const float> interleaved) {
    const int bits = kind_of(format).bits;
    const double most = std::ldexp(1.0, bits - 1);
    whole.resize(interleaved.size());
    for (std::size_t i = 0; i < interleaved.size(); ++i) {
      double sample = static_cast<double>(interleaved[i]) * most;
      if (bits == 16)
        sample += triangular(frames + i / channels, static_cast<std::uint32_t>(i % channels));
      const double rounded = std::isnan(sample) ? 0 : std::nearbyint(sample);
      const auto kept = static_cast<std::int64_t>(std::clamp(rounded, -most, most - 1));
      whole[i] = static_cast<int>(kept * (std::int64_t{1} << (32 - bits)));
    }
  }
};

WavWriter::WavWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
WavWriter::WavWriter(WavWriter&&) noexcept = default;
WavWriter& WavWriter::operator=(WavWriter&&) noexcept = default;
WavWriter::~WavWriter() = default;

Result<WavWriter> WavWriter::create(const std::string& path, int channels, int rate_hz,
                                    SampleFormat format, std::span<const Speaker> speakers) {
  assert(speakers.empty() || speakers.size() == static_cast<std::size_t>(channels));
  if (const auto right = check_sound_file(path, channels); !right.ok()) return right.error();
  const Kind& kind = kind_of(format);
  auto state = std::make_unique<State>();
  state->path = path;
  state->channels = static_cast<std::size_t>(channels);
  state->format = format;
  state->flac = is_flac(path);
  if (const auto right = check_flac(path, kind); !right.ok()) return right.error();
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    return state->failed("it exists and is no regular file");

  state->temporary = path + ".XXXXXX.tmp";
  state->descriptor = ::mkstemps(state->temporary.data(), 4);
  if (state->descriptor < 0) {
    const int error = errno;
    state->temporary.clear();
    return state->failed(std::strerror(error));
  }
  const mode_t mask = ::umask(0);  // mkstemps makes the file private; it should be like any other
  ::umask(mask);
  ::fchmod(state->descriptor, 0666 & ~mask);

  SF_INFO info{};
  info.channels = channels;
  info.samplerate = rate_hz;
  const int container = state->flac                         ? SF_FORMAT_FLAC
                        : speakers.empty() && channels <= 2 ? SF_FORMAT_WAV
                                                            : SF_FORMAT_WAVEX;
  info.format = container | kind.subtype;
  state->sound = sf_open_fd(state->descriptor, SFM_WRITE, &info, SF_FALSE);
  if (state->sound == nullptr) return state->failed(sf_strerror(nullptr));
  sf_command(state->sound, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  // The PEAK chunk holds the time of day, and the same sound should be the same bytes.
  sf_command(state->sound, SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);
  if (container == SF_FORMAT_WAVEX) {
    std::vector<int> map(state->channels, SF_CHANNEL_MAP_INVALID);
    if (!speakers.empty()) std::ranges::transform(speakers, map.begin(), channel_map_of);
    sf_command(state->sound, SFC_SET_CHANNEL_MAP_INFO, map.data(),
               static_cast<int>(map.size() * sizeof(int)));
  }
  return WavWriter(std::move(state));
}

Result<void> WavWriter::write(std::span<const float> interleaved) {
  State& state = *state_;
  const Kind& kind = kind_of(state.format);
  const std::size_t frames = interleaved.size() / state.channels;
  state.bytes += interleaved.size() * static_cast<std::size_t>(kind.bits / 8);
  if (!state.flac && state.bytes > kMostWav_bytes)
    return state.failed("a WAV file holds at most 4 GiB; write less");
  const auto count = static_cast<sf_count_t>(frames);
  sf_count_t written = 0;
  if (state.format == SampleFormat::kFloat32) {
    written = sf_writef_float(state.sound, interleaved.data(), count);
  } else {
    state.quantise(interleaved);
    written = sf_writef_int(state.sound, state.whole.data(), count);
  }
  state.frames += frames;
  if (written != count) return state.failed(sf_strerror(state.sound));
  return {};
}

Result<void> WavWriter::finish() {
  State& state = *state_;
  const int closed = sf_close(std::exchange(state.sound, nullptr));
  if (closed != 0) return state.failed(sf_error_number(closed));
  if (::fsync(state.descriptor) != 0) return state.failed(std::strerror(errno));
  if (::rename(state.temporary.c_str(), state.path.c_str()) != 0)
    return state.failed(std::strerror(errno));
  state.temporary.clear();
  // The name is on the disk only once its folder is.
  std::string folder = std::filesystem::path(state.path).parent_path().string();
  if (folder.empty()) folder = ".";
  const int directory = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory >= 0) {
    ::fsync(directory);
    ::close(directory);
  }
  return {};
}

}  // namespace clamor
