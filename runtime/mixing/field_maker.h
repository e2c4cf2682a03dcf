// field_maker.h: divides a sample into voices and taps, and makes the responses of the taps.
//
// The loudest sources of a sample are voices (Ears::voices), which glide from keyframe to keyframe;
// all others are taps of a response per signal (sparse_response.h), which is made anew now and then
// and convolved with the signal by the mixer (field_mixer.h). So a tap costs nothing per sample of
// sound, and nothing at all while listener and sample rest.
//
// A response holds from its keyframe on, and the mixer takes until the next one to fade to it. It
// is therefore made for where the listener will be then, by its velocity. Early taps are renewed
// twice as often as late ones, because there is less to hide an error, and all more often the
// faster the listener moves: between two places that are far apart, the tones of a signal would be
// as loud as by chance at these places, and not as on the way. The less of all sound a signal has,
// the less of that is heard, so its response may be kept for some renewals (kept_for()), which each
// renew a part of the signals. It is made for the middle of that time.
//
// A source that becomes a tap or a voice does so in both within the same kTapFade_keyframes,
// linearly: both are the same sound, so amplitudes add.
//
// Threads: the sampler's.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/listener.h"
#include "runtime/field/field_response.h"
#include "runtime/field/sparse_response.h"
#include "runtime/hrtf/diffuse_hrtf_eq.h"
#include "runtime/mixing/panner.h"
#include "runtime/mixing/tap_choice.h"
#include "runtime/mixing/tap_group.h"
#include "runtime/mixing/voice_kernel.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/reception.h"
#include "runtime/sampling/sampler.h"
#include "runtime/streaming/playable_signals.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

// From so many sources on a field is cheaper than voices.
inline constexpr int kLeastField = 4000;
inline constexpr int kTapFade_keyframes = 4;
// Where time is short, responses are renewed up to so many times less often.
inline constexpr std::size_t kCoarsestField = 4;

class LateDensity;

class FieldMaker {
 public:
  // How taps are heard: by a head, by a panner, or else by two receivers. All must outlive this,
  // and `itd_table` is the head's.
  struct Ears {
    MixMode mode;
    const Hrtf* head = nullptr;
    const ItdTable* itd_table = nullptr;
    const Panner* panner = nullptr;
    bool has_dense_late = false;  // spreads late taps where they are few (late_density.h)
    std::size_t voices = 0;       // so many sources of a sample are voices instead
  };

  // References and `signals` must outlive this. `chooses_taps`: not all sources suit as taps
  // (tap_choice.h), so that all may be voices.
  FieldMaker(const RadiationModel& radiation, PlayableSignals signals, const Ears& ears,
             bool chooses_taps);

  // Whether all sources of these emitters suit: not too many signals begin at different times, for
  // so many voices.
  static bool suits(std::span<const Emitter> emitters, std::size_t voices);

  // Returns the sources that are voices in the next keyframe, which is due at `time_s`, ascending
  // by number. `is_new` if `sample` is not that of the last call.
  std::span<const SampledSource> divide(std::span<const SampledSource> sample, bool is_new,
                                        const Listener& listener, double time_s);
  // Fills in the responses that this keyframe brings, for a listener with a velocity.
  void make(const Listener& listener, const Reception& reception, Keyframe& keyframe);

  // Renews responses so many times less often from the next division on, 1 to kCoarsestField.
  void coarsen(std::size_t times) { coarseness_ = static_cast<int>(std::bit_floor(times)); }

  // Numbers of the sources that are voices from the next division on, ascending.
  std::span<const std::uint64_t> voices() const { return next_numbers_; }

  std::size_t taps() const { return tap_count_; }

  // Stands for what the mixer reads of signals, for loaders of sounds.
  std::span<const Voice> reads() const { return reads_; }
  // Calls visit(signal) for the signals that the mixer may be reading, some more than once.
  template <class Visit>
  void for_signals(const Visit& visit) const {
    for_sounding([&](const FieldInput& input) { visit(input.signal); });
  }

 private:
  // Each part is renewed so often that a listener moves at most so far in between, if a keyframe
  // allows it, and no less often than this.
  static constexpr std::array<double, kFieldParts> kStep_m{0.07, 0.14};
  static constexpr std::array<int, kFieldParts> kMostKeyframes{kTapFade_keyframes / 2,
                                                               kTapFade_keyframes};
  // Gains are kept while the listener is so near the place that they are made for, which lies as
  // far ahead, but no farther than the listener goes in kGainAhead_s; and until it turns so far.
  static constexpr std::array<double, kFieldParts> kGainReach_m{0.2, 0.4};
  static constexpr double kGainTurn_rad = 0.05, kGainAhead_s = 0.25;
  static constexpr double kEarly_frames = 0.1 * kSampleRate_hz;
  static constexpr std::size_t kTapsAtOnce = 256;  // a multiple of a tile
  // A signal's response with such a share of all sound is renewed each time, and one with less of
  // it proportionally less often, a power of two and at most so many times, unless the listener
  // turns so far or so much of all sound becomes voices or taps.
  static constexpr double kKeptShare = 0.25;
  static constexpr int kMostKept = 4;
  static constexpr double kKeptTurn_rad = 0.1, kKeptSwap = 0.005;
  static constexpr float kKeepsVoice = 1.5f;  // weight of a voice over that of a tap

  // Taps of an input that one part has.
  struct Taps {
    explicit Taps(const RadiationModel& radiation) : group(radiation) {}

    TapGroup group;
    std::vector<const SampledSource*> chosen;
    double weight = 0, swapped_weight = 0;  // of those chosen, and of new voices and taps
    std::vector<std::shared_ptr<FieldSignalResponse>> responses;
    std::shared_ptr<const FieldSignalResponse> last;
    ListenerFrame frame;  // of the last one
    bool has_changed = false;
  };

  // Sources that play a signal from the same time on.
  struct Input {
    Input(const RadiationModel& radiation, std::uint32_t of_signal, std::int64_t begins_frames);
    ~Input();
    void reserve(double delay_frames);

    std::uint32_t signal;
    std::int64_t start_frames;
    double longest_frames = 0;                         // delay of a tap
    double first_start_frames = 0;                     // of an emitter, after start_frames
    std::vector<std::unique_ptr<FieldInput>> buffers;  // the last one is in use
    std::unique_ptr<LateDensity> density;              // of the late part
    std::array<Taps, kFieldParts> parts;
  };
  struct Part {
    std::vector<std::unique_ptr<FieldResponse>> responses;
    FieldResponse* last = nullptr;
    std::optional<ListenerFrame> gain_frame;  // of the last response's gains
    Reception reception;
    std::uint64_t renewals = 0;
    std::unique_ptr<DiffuseHrtfEq> eq;  // binaural
  };

  // A tap at the ears. Its amplitude is relative to its gains.
  struct Arrival {
    Vec3f from;
    std::array<double, kEars> delay_frames;  // in the response
    std::array<float, kEars> amplitude;
  };

  // Power and correlation of two responses' spectra in a layer, and what follows for a fade.
  struct LayerSums {
    static constexpr std::size_t kGroups = 48;
    LayerSums(const FieldLayer& layer, double rate_hz);
    SpectrumSums all() { return {power.data(), last_power.data(), correlation.data()}; }
    void clear() {
      for (std::vector<float>* const sums : {&power, &last_power, &correlation})
        std::ranges::fill(*sums, 0.0f);
    }
    void correct(std::span<float> correction) const;

    std::vector<float> power, last_power, correlation;  // by index of a spectrum
    std::vector<std::uint8_t> group;                    // likewise: a quarter of an octave
  };

  // Calls visit(input) for the inputs of responses that are not free.
  template <class Visit>
  void for_sounding(const Visit& visit) const {
    for (const Part& part : parts_)
      for (const auto& response : part.responses) {
        if (response->is_free.load(std::memory_order_acquire)) continue;
        const FieldInput* last = nullptr;
        for (const FieldPartition& one : response->partitions)
          if (one.input != std::exchange(last, one.input)) visit(*one.input);
      }
  }

  Input* input_of(const SampledSource& source, double emission_frames, bool makes);
  void forget_idle_inputs();
  void choose_voices(std::span<const SampledSource> sample, const Listener& listener,
                     double time_s);
  void take_taps(std::span<const SampledSource> sample, const Listener& listener);
  void take_chosen();
  void find_voices(std::span<const SampledSource> sample);
  double taps_speed_mps() const;
  void renew(std::size_t part, const Listener& listener, const Reception& reception,
             Keyframe& keyframe);
  bool needs_gains(std::size_t part, const ListenerFrame& frame) const {
    const std::optional<ListenerFrame>& last = parts_[part].gain_frame;
    return !last || length(frame.centre_m - last->centre_m) > kGainReach_m[part] ||
           length(frame.ahead - last->ahead) > kGainTurn_rad ||
           length(frame.up - last->up) > kGainTurn_rad;
  }
  int kept_for(const Taps& taps) const;
  bool is_due(const Input& input, std::size_t part, const ListenerFrame& frame, int kept,
              std::size_t index) const;
  bool lacks_passes(const Input& input, std::size_t part) const;
  void assemble(std::size_t part, Keyframe& keyframe);
  void renew_gains(std::size_t part);
  void make_gains(Input& input, std::size_t part, std::size_t first, bool of_all);
  float near_m(const VoiceTable& table, std::size_t ear, std::size_t slot) const;
  void add_taps_of(Input& input, std::size_t part);
  static double pieces_of(const TapGroup::Gains& gains, const Arrival& arrival, Input& input);
  void add_piece(const TapGroup::Gains& gains, const Arrival& arrival, double shift_frames,
                 float amplitude, double longest_frames);
  FieldResponse& free_response(Part& part);
  std::shared_ptr<const FieldSignalResponse> make_response(Input& input, std::size_t part);
  void correlate_with(const FieldSignalResponse* last, const FieldSignalResponse& now);

  const RadiationModel& radiation_;
  const PlayableSignals signals_;
  const Ears ears_;
  const Receivers receivers_;
  std::vector<SparseResponse> sparse_;  // by pair of channels
  LayerSums high_sums_, low_sums_;
  std::optional<TapChoice> choice_;
  std::vector<std::unique_ptr<Input>> inputs_;
  std::array<Part, kFieldParts> parts_;
  std::uint64_t made_ = 0;                         // keyframes
  int coarseness_ = 1;                             // a power of two
  bool has_new_sample_ = false;                    // since the last division
  std::array<int, kFieldParts> every_{}, left_{};  // keyframes between renewals, and until the next
  std::vector<std::uint64_t> voice_numbers_, next_numbers_, tap_numbers_;  // ascending
  std::vector<std::pair<double, std::uint64_t>> ranked_;                   // scratch memory
  std::vector<Input*> renewed_;                                            // likewise
  std::vector<SampledSource> voices_;
  std::vector<Voice> made_voices_;      // scratch memory: of a tile
  std::vector<std::vector<Tap>> taps_;  // likewise: by channel
  std::vector<Voice> reads_;
  std::size_t tap_count_ = 0;
  double weight_ = 0;  // of the sample
};

}  // namespace clamor
