// voice_kernel.h: delays and gains of many voices at once, for whatever vectors the CPU has.
//
// Delays and distances are in double, 2 to 8 voices at a time; gains in float, the bands of a voice
// at a time. They are what received_intensity() and delay_s() say: gains within 1e-4 (0.001 dB)
// of the voice's loudest band or of their own, delays within 1e-6 frames. Additions,
// multiplications, divisions and square roots only, none of them fused, so that every CPU gives the
// same bits.
//
// Highway is visible in voice_kernel.cpp only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/vec.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/mixing/voice_table.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

// Where a listener's receivers are: two, or one in the middle. A source that moves is where it was
// when the sound left it that arrives in the middle; what arrives at a receiver beside it left the
// source a little before or after.
struct ListenerFrame {
  Vec3 centre_m{};
  std::array<Vec3, kEars> ear_positions_m{};
  Vec3 ahead{}, left{}, up{};
  int places = kEars;  // that differ
  bool operator==(const ListenerFrame&) const = default;
};

// What the listener's place says about voices in slots first to last, both whole tiles: the table's
// last columns. With `lags`, which takes one place, the ears' delays differ by those.
void place_voices(VoiceTable& table, const ListenerFrame& stance, const ItdTable* lags,
                  std::size_t first, std::size_t last);

// A source that moves in a straight line round the moment that it was at a place. Ages and speeds
// are in metres that sound travels.
struct MovingSourcePoint {
  Vec3f position_m{};
  Vec3f mach{};
  double age_m = 0;  // how long before it is heard it was there; of one at rest any number

  // How much later than that it was left by the sound that arrives at `place`: the earlier solution
  // of age_m - later = |place - position_m - later x mach|.
  double later_m(const Vec3& place) const;
};

// The direction and a delay of one source, which need not be in the table: the same bits.
Vec3f direction_from(const ListenerFrame& stance, const Vec3f& position_m);
double delay_frames(const VoiceTable& table, const ListenerFrame& stance, const ItdTable* lags,
                    const MovingSourcePoint& source, double emission_frames, int ear);

// Of those slots, which were placed: voices[slot]'s delays, gains and direction.
void make_voices(const VoiceTable& table, int places, std::span<const std::uint32_t> slots,
                 Voice* voices);

}  // namespace clamor
