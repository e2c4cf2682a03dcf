#include "formats/audio/flac_codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <FLAC/format.h>
#include <FLAC/stream_decoder.h>
#include <FLAC/stream_encoder.h>

namespace clamor {

namespace {

constexpr unsigned kCompressionLevel = 5;  // libFLAC's default

}  // namespace

struct FlacEncoder::State {
  ~State() { FLAC__stream_encoder_delete(library); }  // accepts null

  static FLAC__StreamEncoderWriteStatus write(const FLAC__StreamEncoder*, const FLAC__byte buffer[],
                                              std::size_t bytes, std::uint32_t, std::uint32_t,
                                              void* user) {
    auto& state = *static_cast<State*>(user);
    if (!state.store(state.position, std::as_bytes(std::span(buffer, bytes))))
      return FLAC__STREAM_ENCODER_WRITE_STATUS_FATAL_ERROR;
    state.position += bytes;
    return FLAC__STREAM_ENCODER_WRITE_STATUS_OK;
  }
  static FLAC__StreamEncoderSeekStatus seek(const FLAC__StreamEncoder*, FLAC__uint64 offset,
                                            void* user) {
    static_cast<State*>(user)->position = offset;
    return FLAC__STREAM_ENCODER_SEEK_STATUS_OK;
  }
  static FLAC__StreamEncoderTellStatus tell(const FLAC__StreamEncoder*, FLAC__uint64* offset,
                                            void* user) {
    *offset = static_cast<State*>(user)->position;
    return FLAC__STREAM_ENCODER_TELL_STATUS_OK;
  }

  FLAC__StreamEncoder* library = nullptr;
  Store store;
  std::uint64_t position = 0;
  std::uint32_t channels = 1;
};

FlacEncoder::FlacEncoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
FlacEncoder::~FlacEncoder() = default;

std::unique_ptr<FlacEncoder> FlacEncoder::create(int channels, int rate_hz, int bits, Store store) {
  auto state = std::make_unique<State>();
  state->store = std::move(store);
  state->channels = static_cast<std::uint32_t>(channels);
  state->library = FLAC__stream_encoder_new();
  if (state->library == nullptr ||
      !FLAC__stream_encoder_set_channels(state->library, state->channels) ||
      !FLAC__stream_encoder_set_sample_rate(state->library, static_cast<std::uint32_t>(rate_hz)) ||
      !FLAC__stream_encoder_set_bits_per_sample(state->library, static_cast<std::uint32_t>(bits)) ||
      !FLAC__stream_encoder_set_compression_level(state->library, kCompressionLevel) ||
      FLAC__stream_encoder_init_stream(state->library, State::write, State::seek, State::tell,
                                       nullptr, state.get()) != FLAC__STREAM_ENCODER_INIT_STATUS_OK)
    return nullptr;
  return std::unique_ptr<FlacEncoder>(new FlacEncoder(std::move(state)));
}

bool FlacEncoder::write(std::span<const std::int32_t> interleaved) {
  return FLAC__stream_encoder_process_interleaved(
             state_->library, interleaved.data(),
             static_cast<std::uint32_t>(interleaved.size() / state_->channels)) != 0;
}

bool FlacEncoder::finish() { return FLAC__stream_encoder_finish(state_->library) != 0; }

struct FlacDecoder::State {
  ~State() { FLAC__stream_decoder_delete(library); }  // accepts null

  static FLAC__StreamDecoderReadStatus read(const FLAC__StreamDecoder*, FLAC__byte buffer[],
                                            std::size_t* bytes, void* user) {
    auto& state = *static_cast<State*>(user);
    *bytes = std::min(*bytes, state.file.size() - state.position);
    if (*bytes == 0) return FLAC__STREAM_DECODER_READ_STATUS_END_OF_STREAM;
    std::memcpy(buffer, state.file.data() + state.position, *bytes);
    state.position += *bytes;
    return FLAC__STREAM_DECODER_READ_STATUS_CONTINUE;
  }
  static FLAC__StreamDecoderWriteStatus write(const FLAC__StreamDecoder*, const FLAC__Frame* frame,
                                              const FLAC__int32* const buffer[], void* user) {
    auto& state = *static_cast<State*>(user);
    if (frame->header.channels != state.channels || frame->header.bits_per_sample != state.bits) {
      state.problem = "a frame has another format than the stream";
      return FLAC__STREAM_DECODER_WRITE_STATUS_ABORT;
    }
    const float full_scale = std::ldexp(1.0f, static_cast<int>(state.bits) - 1);
    state.decoded.clear();
    state.used = 0;
    for (std::size_t i = 0; i < frame->header.blocksize; ++i)
      for (std::uint32_t c = 0; c < state.channels; ++c)
        state.decoded.push_back(static_cast<float>(buffer[c][i]) / full_scale);
    return FLAC__STREAM_DECODER_WRITE_STATUS_CONTINUE;
  }
  static void describe(const FLAC__StreamDecoder*, const FLAC__StreamMetadata* block, void* user) {
    if (block->type != FLAC__METADATA_TYPE_STREAMINFO) return;
    auto& state = *static_cast<State*>(user);
    const FLAC__StreamMetadata_StreamInfo& info = block->data.stream_info;
    state.channels = info.channels;
    state.rate_hz = info.sample_rate;
    state.bits = info.bits_per_sample;
    if (info.total_samples > 0) state.frames_left = info.total_samples;  // 0 is unknown
  }
  static void fail(const FLAC__StreamDecoder*, FLAC__StreamDecoderErrorStatus status, void* user) {
    static_cast<State*>(user)->problem = status == FLAC__STREAM_DECODER_ERROR_STATUS_LOST_SYNC
                                             ? "a frame is missing"
                                             : "a frame is broken";
  }

  // Decodes frames until one has samples.
  bool decode() {
    while (problem.empty() && used == decoded.size()) {
      if (!FLAC__stream_decoder_process_single(library)) {
        if (problem.empty()) problem = "it cannot be decoded";
        return false;
      }
      if (FLAC__stream_decoder_get_state(library) == FLAC__STREAM_DECODER_END_OF_STREAM) break;
    }
    return problem.empty() && used < decoded.size();
  }

  FLAC__StreamDecoder* library = nullptr;
  std::span<const std::byte> file;
  std::size_t position = 0;
  std::uint32_t channels = 0, rate_hz = 0, bits = 0;
  std::uint64_t frames_left = ~std::uint64_t{0};
  std::vector<float> decoded;  // one frame of the stream, interleaved
  std::size_t used = 0;
  std::string problem;
};

FlacDecoder::FlacDecoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
FlacDecoder::~FlacDecoder() = default;

std::unique_ptr<FlacDecoder> FlacDecoder::open(std::span<const std::byte> file) {
  constexpr std::string_view kMark = "fLaC";  // libFLAC itself would look for frames in any file
  if (file.size() < kMark.size() || std::memcmp(file.data(), kMark.data(), kMark.size()) != 0)
    return nullptr;
  auto state = std::make_unique<State>();
  state->file = file;
  state->library = FLAC__stream_decoder_new();
  if (state->library == nullptr ||
      FLAC__stream_decoder_init_stream(state->library, State::read, nullptr, nullptr, nullptr,
                                       nullptr, State::write, State::describe, State::fail,
                                       state.get()) != FLAC__STREAM_DECODER_INIT_STATUS_OK ||
      !FLAC__stream_decoder_process_until_end_of_metadata(state->library) || state->channels == 0)
    return nullptr;
  return std::unique_ptr<FlacDecoder>(new FlacDecoder(std::move(state)));
}

int FlacDecoder::channels() const { return static_cast<int>(state_->channels); }
int FlacDecoder::rate_hz() const { return static_cast<int>(state_->rate_hz); }
const std::string& FlacDecoder::problem() const { return state_->problem; }

std::size_t FlacDecoder::read(std::span<float> interleaved) {
  State& state = *state_;
  const std::size_t wanted = static_cast<std::size_t>(
      std::min<std::uint64_t>(interleaved.size() / state.channels, state.frames_left));
  std::size_t done = 0;
  while (done < wanted && state.decode()) {
    const std::size_t frames =
        std::min(wanted - done, (state.decoded.size() - state.used) / state.channels);
    std::copy_n(state.decoded.begin() + static_cast<std::ptrdiff_t>(state.used),
                frames * state.channels,
                interleaved.begin() + static_cast<std::ptrdiff_t>(done * state.channels));
    state.used += frames * state.channels;
    done += frames;
  }
  state.frames_left -= done;
  return done;
}

std::string flac_version() { return std::string("libFLAC ") + FLAC__VERSION_STRING; }

}  // namespace clamor
