// field_maker_taps.cpp: how FieldMaker makes taps of sources.
#include <algorithm>
#include <array>

#include "runtime/field/late_density.h"
#include "runtime/mixing/field_maker.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/voices/gain_ramp_kernel.h"

namespace clamor {

namespace {

Tap tap_at(double delay_frames, double low_delay_frames, const Bands& gain, float amplitude) {
  const double low = low_delay_frames / kLowRate;
  const auto whole = static_cast<std::int32_t>(delay_frames),
             low_whole = static_cast<std::int32_t>(low + 0.5);
  return {whole,
          low_whole,
          static_cast<float>(delay_frames - whole),
          static_cast<float>(low - low_whole),
          amplitude,
          &gain};
}

}  // namespace

// Gains of all taps of a part.
void FieldMaker::renew_gains(std::size_t part) {
  if (parts_[part].eq != nullptr) parts_[part].eq->begin();
  for (const auto& input : inputs_) {
    TapGroup& group = input->parts[part].group;
    group.begin_gains();
    for (std::size_t first = 0; first < group.used(); first += VoiceTable::kTile)
      make_gains(*input, part, first, true);
  }
}

// Gains of a tile, of all its taps or of those that need them. Powers by direction are those of
// all.
void FieldMaker::make_gains(Input& input, std::size_t part_index, std::size_t first, bool of_all) {
  const Part& part = parts_[part_index];
  TapGroup& group = input.parts[part_index].group;
  VoiceTable& table = group.table();
  std::array<std::uint32_t, VoiceTable::kTile> made;
  std::size_t count = 0;
  for (std::size_t s = first; s < std::min(first + VoiceTable::kTile, group.used()); ++s)
    if (group.presence(s) > 0 && (group.take_new_gains(s) || of_all))
      made[count++] = static_cast<std::uint32_t>(s);
  if (count == 0) return;
  const auto slots = std::span(made).first(count);
  place_voices(table, *part.gain_frame, ears_.itd_table, first, first + VoiceTable::kTile);
  make_voices(table, part.gain_frame->places, slots, made_voices_.data(), first);
  const Bands mean_square = of_all ? signals_[input.signal].mean_square() : Bands{};
  for (const std::uint32_t s : slots) {
    const Voice& voice = made_voices_[s - first];
    TapGroup::Gains& gains = group.gains(s);
    gains.at = voice.gain;
    for (std::size_t e = 0; e < kEars; ++e) gains.distance_m[e] = near_m(table, e, s);
    if (ears_.head != nullptr) {
      const DirectionMesh::Place place = ears_.head->place(voice.from, gains.direction);
      gains.low_itd_frames = static_cast<float>(ears_.head->low_itd_frames(place));
      hrtf_gains(part.eq->corners(place), voice.gain, mean_square, gains.at);
    } else if (!part.reception.is_omnidirectional()) {
      for (std::size_t e = 0; e < kEars; ++e) {
        const Vec3 towards_m = Vec3(table.position_of(s)) - part.gain_frame->ear_positions_m[e];
        const Bands gain = part.reception.gain(static_cast<int>(e), Vec3f(towards_m));
        for (std::size_t b = 0; b < kBandCount; ++b) gains.at[e][b] *= gain[b];
      }
    }
  }
}

// The distance on which a tap's amplitude depends, where it has been placed.
float FieldMaker::near_m(const VoiceTable& table, std::size_t ear, std::size_t slot) const {
  const std::size_t place = receivers_ == Receivers::kOne ? 0 : ear;
  return std::max(table.arrivals.distance_m[place][slot], table.geometry.radius_m[slot]);
}

void FieldMaker::add_taps_of(Input& input, std::size_t part) {
  constexpr std::size_t kTile = VoiceTable::kTile;
  TapGroup& group = input.parts[part].group;
  VoiceTable& table = group.table();
  const VoiceArrivals& arrivals = table.arrivals;
  const std::size_t used = group.used();
  const bool is_late = ears_.has_dense_late && part == kLateField;
  if (is_late) input.density->begin();
  const double longest_frames =
      static_cast<double>((input.buffers.back()->blocks.size()) * kHighField.partition) - 4;
  for (std::size_t first = 0; first < used; first += kTapsAtOnce) {
    const std::size_t last = std::min(first + kTapsAtOnce, used);
    for (std::size_t tile = first; tile < last; tile += kTile) make_gains(input, part, tile, false);
    place_voices(table, input.parts[part].frame, ears_.itd_table, first,
                 (last + kTile - 1) / kTile * kTile, true);
    for (auto& taps : taps_) taps.clear();
    for (std::size_t s = first; s < last; ++s) {
      const float presence = group.presence(s);
      if (presence == 0) continue;
      const TapGroup::Gains& gains = group.gains(s);
      Arrival arrival;
      arrival.from = {arrivals.from[0][s], arrivals.from[1][s], arrivals.from[2][s]};
      for (std::size_t e = 0; e < kEars; ++e) {
        arrival.delay_frames[e] =
            arrivals.delay_frames[e][s] - static_cast<double>(input.start_frames);
        arrival.amplitude[e] = presence * gains.distance_m[e] / near_m(table, e, s);
      }
      const double pieces = is_late && table.radiation.kind[s] >= VoiceRadiation::kDiffuse
                                ? pieces_of(gains, arrival, input)
                                : 1;
      for (std::uint32_t k = 0; k < pieces; ++k) {
        const LateDensity::Piece piece =
            LateDensity::piece(static_cast<std::uint32_t>(s), k, pieces);
        add_piece(gains, arrival, piece.shift_frames, piece.amplitude, longest_frames);
      }
    }
    for (std::size_t c = 0; c < taps_.size(); ++c) sparse_[c / kEars].add(c % kEars, taps_[c]);
  }
}

double FieldMaker::pieces_of(const TapGroup::Gains& gains, const Arrival& arrival, Input& input) {
  Bands power{};
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float gain = arrival.amplitude[e] * gains.at[e][b];
      power[b] += gain * gain;
    }
  return input.density->pieces(arrival.delay_frames[0] - input.first_start_frames, power);
}

// Adds a tap, or a piece of it, to the channels.
void FieldMaker::add_piece(const TapGroup::Gains& gains, const Arrival& arrival,
                           double shift_frames, float amplitude, double longest_frames) {
  const ChannelGains panned =
      ears_.panner != nullptr ? ears_.panner->gains(arrival.from) : ChannelGains{1, 1};
  for (std::size_t c = 0; c < taps_.size(); ++c) {
    const std::size_t e = c % kEars;
    const float gain = panned[c] * arrival.amplitude[e] * amplitude;
    if (gain == 0) continue;
    const double delay_frames = arrival.delay_frames[e] + shift_frames;
    const double low_frames =
        delay_frames + (e == 0 ? -0.5 : 0.5) * static_cast<double>(gains.low_itd_frames);
    if (!(delay_frames >= 4 && delay_frames < longest_frames)) continue;
    taps_[c].push_back(tap_at(delay_frames, low_frames, gains.at[e], gain));
  }
}

}  // namespace clamor
