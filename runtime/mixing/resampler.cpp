#include "runtime/mixing/resampler.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <samplerate.h>

namespace clamor {

namespace {

constexpr std::size_t kMaxInput_frames = 8192;
constexpr double kTouched_s = 2;  // longer than the library's buffers at any rate

}  // namespace

struct Resampler::State {
  ~State() {
    if (library != nullptr) src_delete(library);
  }

  std::size_t channels = 0;
  double ratio = 1;  // output rate over input rate
  SRC_STATE* library = nullptr;
  std::vector<float> input;
  std::size_t input_begin = 0, input_end = 0;  // unused frames of the input
};

Resampler::Resampler(std::unique_ptr<State> state) : state_(std::move(state)) {}
Resampler::~Resampler() = default;

Result<std::unique_ptr<Resampler>> Resampler::create(int channels, int from_hz, int to_hz) {
  auto state = std::make_unique<State>();
  state->channels = static_cast<std::size_t>(channels);
  state->ratio = static_cast<double>(to_hz) / from_hz;
  int problem = 0;
  state->library = src_new(SRC_SINC_MEDIUM_QUALITY, channels, &problem);
  if (state->library == nullptr || src_is_valid_ratio(state->ratio) == 0)
    return Error("cannot turn " + std::to_string(channels) + " channels at " +
                 std::to_string(from_hz) + " Hz into " + std::to_string(to_hz) + " Hz" +
                 (problem != 0 ? std::string(" (") + src_strerror(problem) + ")" : "") +
                 "; use a device with another rate");
  state->input.resize(kMaxInput_frames * state->channels);
  std::unique_ptr<Resampler> resampler(new Resampler(std::move(state)));

  // Touches every page of the library's buffers before the audio thread uses them.
  std::vector<float> silence(static_cast<std::size_t>(kTouched_s * to_hz) *
                             static_cast<std::size_t>(channels));
  const auto nothing = [](void*, std::span<float> interleaved) noexcept {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
  };
  resampler->read(silence, {nothing, nullptr});
  src_reset(resampler->state_->library);
  resampler->state_->input_begin = resampler->state_->input_end = 0;
  return resampler;
}

void Resampler::read(std::span<float> interleaved, Source source) noexcept {
  State& state = *state_;
  const std::size_t frames = interleaved.size() / state.channels;
  for (std::size_t done = 0; done < frames;) {
    if (state.input_begin == state.input_end) {
      const auto wanted =
          static_cast<std::size_t>(std::ceil(static_cast<double>(frames - done) / state.ratio));
      state.input_begin = 0;
      state.input_end = std::clamp(wanted, std::size_t{1}, kMaxInput_frames);
      source.fill(source.context, std::span(state.input).first(state.input_end * state.channels));
    }
    SRC_DATA data{};
    data.data_in = state.input.data() + state.input_begin * state.channels;
    data.input_frames = static_cast<long>(state.input_end - state.input_begin);
    data.data_out = interleaved.data() + done * state.channels;
    data.output_frames = static_cast<long>(frames - done);
    data.src_ratio = state.ratio;
    // Only a bug of ours leads here: give silence instead of looping.
    if (src_process(state.library, &data) != 0) {
      std::fill(interleaved.begin() + static_cast<std::ptrdiff_t>(done * state.channels),
                interleaved.end(), 0.0f);
      return;
    }
    state.input_begin += static_cast<std::size_t>(data.input_frames_used);
    done += static_cast<std::size_t>(data.output_frames_gen);
  }
}

}  // namespace clamor
