#include "formats/audio/wav_writer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/memory_size.h"
#include "common/random.h"
#include "common/utf8_path.h"
#include "formats/audio/flac_codec.h"
#include "formats/audio/wav_header.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr int kMaxFlacChannels = 8;
constexpr std::uint64_t kDitherSeed = 0x0d17'4e72;

struct Kind {
  SampleFormat format;
  const char* name;
  int bits;
};
constexpr Kind kKinds[] = {{SampleFormat::kFloat32, "float", 32},
                           {SampleFormat::kPcm32, "32", 32},
                           {SampleFormat::kPcm24, "24", 24},
                           {SampleFormat::kPcm16, "16", 16}};

const Kind& kind_of(SampleFormat format) {
  return *std::ranges::find(kKinds, format, &Kind::format);
}

bool ends_in(const std::string& path, std::string_view wanted) {
  std::string ending = path_of(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending == wanted;
}

bool is_flac(const std::string& path) { return ends_in(path, ".flac"); }

Result<void> check_flac(const std::string& path, const Kind& kind) {
  if (!is_flac(path) || kind.bits == 24 || kind.bits == 16) return {};
  return Error(fmt::format("{}: FLAC holds 16 or 24 bits, not {}; ask for 24 or write a .wav file",
                           path, kind.name));
}

bool is_stream(const std::string& path) {
  const auto target = OutputTarget::find(path);
  return target.ok() && target->is_stream();
}

std::optional<std::uint32_t> channel_mask(int channels, std::span<const Speaker> speakers) {
  if (speakers.empty() && channels <= 2) return std::nullopt;
  std::uint32_t mask = 0;
  for (const Speaker speaker : speakers) mask |= static_cast<std::uint32_t>(speaker);
  return mask;
}

// Triangular dither in (-1, 1) steps, from two uniform random numbers.
double triangular(std::uint64_t frame, std::uint32_t channel) {
  const RandomBits bits = philox(
      kDitherSeed,
      {static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32), channel, 0});
  return unit(bits[0]) - unit(bits[1]);
}

}  // namespace

Result<void> check_sound_file(const std::string& path, int channels) {
  if (is_flac(path) && channels > kMaxFlacChannels)
    return Error(fmt::format("{}: FLAC holds at most {} channels, not {}; write a .wav file.", path,
                             kMaxFlacChannels, channels));
  if (is_flac(path) || ends_in(path, ".wav") || is_stream(path)) return {};
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
  explicit State(AtomicFile opened) : file(std::move(opened)) {}

  AtomicFile file;
  WavShape shape;
  SampleFormat format = SampleFormat::kFloat32;
  Appearance appearance = Appearance::kWhenComplete;
  bool has_appeared = false;
  Result<void> flac_error;  // of storing what libFLAC made
  std::unique_ptr<FlacEncoder> flac;
  std::uint64_t frames = 0;
  std::vector<std::int32_t> whole;  // samples of one write
  std::vector<std::byte> packed;    // samples in the byte layout of a WAV file

  Error failed(const char* what) const {
    return Error(file.path() + ": cannot be written: " + what +
                 ". Check the folder, its rights and the space left.");
  }

  std::uint64_t data_bytes() const { return frames * shape.frame_bytes(); }

  // Rounds samples to integers.
  void quantize_sources(std::span<const float> interleaved) {
    const auto channels = static_cast<std::size_t>(shape.channels);
    const double most = std::ldexp(1.0, shape.bits - 1);
    whole.resize(interleaved.size());
    for (std::size_t i = 0; i < interleaved.size(); ++i) {
      double sample = static_cast<double>(interleaved[i]) * most;
      if (shape.bits == 16)
        sample += triangular(frames + i / channels, static_cast<std::uint32_t>(i % channels));
      const double rounded = std::isnan(sample) ? 0 : std::nearbyint(sample);
      whole[i] = static_cast<std::int32_t>(std::clamp(rounded, -most, most - 1));
    }
  }

  // Packs the used bytes of each sample, little-endian.
  std::span<const std::byte> pack() {
    const auto bytes = static_cast<std::size_t>(shape.bits / 8);
    packed.resize(whole.size() * bytes);
    for (std::size_t i = 0; i < whole.size(); ++i)
      std::memcpy(packed.data() + i * bytes, &whole[i], bytes);
    return packed;
  }

  Result<void> open_flac() {
    flac = FlacEncoder::create(shape.channels, shape.rate_hz, shape.bits,
                               [this](std::uint64_t offset, std::span<const std::byte> bytes) {
                                 flac_error = file.write_at(memory_size(offset), bytes);
                                 return flac_error.ok();
                               });
    return flac != nullptr ? Result<void>() : flac_failure();
  }

  Result<void> flac_failure() const {
    return flac_error.ok() ? failed("libFLAC refuses it") : flac_error;
  }

  Result<void> write_samples(std::span<const float> interleaved) {
    if (format == SampleFormat::kFloat32) return file.write(std::as_bytes(interleaved));
    quantize_sources(interleaved);
    if (flac == nullptr) return file.write(pack());
    return flac->write(whole) ? Result<void>() : flac_failure();
  }

  // The header of a growing stream cannot be rewritten, so it leaves the length open.
  bool has_length() const { return !(file.is_stream() && appearance == Appearance::kAtOnce); }

  Result<void> write_header() {
    if (!has_length()) return {};
    return file.write_at(0, wav_header(shape, data_bytes()));
  }

  Result<void> write(std::span<const float> interleaved) {
    if (auto written = write_samples(interleaved); !written.ok()) return written;
    frames += interleaved.size() / static_cast<std::size_t>(shape.channels);
    if (appearance != Appearance::kAtOnce) return {};
    if (flac == nullptr)
      if (auto written = write_header(); !written.ok()) return written;
    return has_appeared ? Result<void>() : file.appear();
  }
};

WavWriter::WavWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
WavWriter::WavWriter(WavWriter&&) noexcept = default;
WavWriter& WavWriter::operator=(WavWriter&&) noexcept = default;
WavWriter::~WavWriter() = default;

Result<WavWriter> WavWriter::create(const std::string& path, int channels, int rate_hz,
                                    SampleFormat format, std::span<const Speaker> speakers,
                                    Appearance appearance) {
  assert(speakers.empty() || speakers.size() == static_cast<std::size_t>(channels));
  if (const auto right = check_sound_file(path, channels); !right.ok()) return right.error();
  const Kind& kind = kind_of(format);
  if (is_flac(path))
    if (const auto right = check_flac(path, kind); !right.ok()) return right.error();
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  if (is_flac(path) && file->is_stream() && appearance == Appearance::kAtOnce)
    return Error(path +
                 ": a recording into a pipe or a device is WAV, because FLAC needs a file; "
                 "name it .wav");
  auto state = std::make_unique<State>(std::move(*file));
  state->shape = {channels, rate_hz, kind.bits, format == SampleFormat::kFloat32,
                  channel_mask(channels, speakers)};
  state->format = format;
  state->appearance = appearance;
  const std::optional<std::uint64_t> nothing_yet = 0;
  const auto begun = is_flac(path)
                         ? state->open_flac()
                         : state->file.write(wav_header(
                               state->shape, state->has_length() ? nothing_yet : std::nullopt));
  if (!begun.ok()) return begun.error();
  // A pipe blocks here, rather than at the first write, until it has a reader.
  if (!state->has_length())
    if (const auto appeared = state->file.appear(); !appeared.ok()) return appeared.error();
  state->has_appeared = !state->has_length();
  return WavWriter(std::move(state));
}

Result<void> WavWriter::write(std::span<const float> interleaved) {
  State& state = *state_;
  const auto written = state.write(interleaved);
  if (!written.ok() && state.has_appeared)
    return Error(written.error().message + "; what was written before is kept");
  state.has_appeared = state.appearance == Appearance::kAtOnce;
  return written;
}

Result<void> WavWriter::finish() {
  State& state = *state_;
  if (state.flac != nullptr) {
    if (!state.flac->finish()) return state.flac_failure();
  } else {
    if (state.data_bytes() % 2 != 0)
      if (auto padded = state.file.write(std::array{std::byte{0}}); !padded.ok()) return padded;
    if (auto written = state.write_header(); !written.ok()) return written;
  }
  return state.file.commit();
}

}  // namespace clamor
