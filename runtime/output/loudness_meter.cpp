#include "runtime/output/loudness_meter.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <new>

#include <ebur128.h>

#include "common/sample_rate.h"

namespace clamor {

namespace {

// libebur128's channel position, which decides the weight: side channels count 1.5 dB more.
struct Place {
  Speaker speaker;
  int position;
};
constexpr std::array<Place, 12> kPlaces = {{{Speaker::kFrontLeft, EBUR128_LEFT},
                                            {Speaker::kFrontRight, EBUR128_RIGHT},
                                            {Speaker::kFrontCentre, EBUR128_CENTER},
                                            {Speaker::kLowFrequency, EBUR128_UNUSED},
                                            {Speaker::kSideLeft, EBUR128_LEFT_SURROUND},
                                            {Speaker::kSideRight, EBUR128_RIGHT_SURROUND},
                                            {Speaker::kBackLeft, EBUR128_Mp135},
                                            {Speaker::kBackRight, EBUR128_Mm135},
                                            {Speaker::kTopFrontLeft, EBUR128_Up045},
                                            {Speaker::kTopFrontRight, EBUR128_Um045},
                                            {Speaker::kTopBackLeft, EBUR128_Up135},
                                            {Speaker::kTopBackRight, EBUR128_Um135}}};

int position_of(Speaker speaker) {
  return std::ranges::find(kPlaces, speaker, &Place::speaker)->position;
}

}  // namespace

struct LoudnessMeter::State {
  ebur128_state* meter = nullptr;
  std::size_t channels = 0;
  double offset_lu = 0;
  ~State() { ebur128_destroy(&meter); }
};

LoudnessMeter::LoudnessMeter(int channels, std::span<const Speaker> speakers)
    : state_(std::make_unique<State>()) {
  state_->channels = static_cast<std::size_t>(channels);
  state_->meter = ebur128_init(static_cast<unsigned>(channels), kSampleRate_hz,
                               EBUR128_MODE_M | EBUR128_MODE_S);
  if (state_->meter == nullptr) throw std::bad_alloc();
  if (speakers.empty() && channels <= 2) return;
  if (speakers.empty()) state_->offset_lu = 10 * std::log10(2.0);
  for (unsigned c = 0; c < static_cast<unsigned>(channels); ++c)
    ebur128_set_channel(state_->meter, c,
                        !speakers.empty() ? position_of(speakers[c])
                        : c == 0          ? EBUR128_CENTER
                                          : EBUR128_UNUSED);
}

LoudnessMeter::~LoudnessMeter() = default;

void LoudnessMeter::add(std::span<const float> interleaved) {
  assert(interleaved.size() % state_->channels == 0);
  ebur128_add_frames_float(state_->meter, interleaved.data(),
                           interleaved.size() / state_->channels);
}

double LoudnessMeter::momentary_lufs() const {
  double lufs = -std::numeric_limits<double>::infinity();
  ebur128_loudness_momentary(state_->meter, &lufs);
  return lufs + state_->offset_lu;
}

double LoudnessMeter::short_term_lufs() const {
  double lufs = -std::numeric_limits<double>::infinity();
  ebur128_loudness_shortterm(state_->meter, &lufs);
  return lufs + state_->offset_lu;
}

}  // namespace clamor
