// voice_kernel.h: vectorised delays and gains of many voices.
//
// Delays and distances are in double, 2 to 8 voices at a time; gains in float, the bands of a voice
// at a time. Results match received_intensity() and delay_s(): gains within 1e-4 (0.001 dB) of the
// voice's loudest band or of themselves, delays within 1e-6 frames. Uses only additions,
// multiplications, divisions and square roots, without fusing, so that every CPU gives the same
// bits.
//
// Highway is visible in voice_kernel.cpp only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/listener.h"
#include "common/vec.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/mixing/voice_table.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

// A listener's receivers, two or one in the centre, and its axes. A moving source is placed where
// it was when the sound that arrives in the centre left it; the sound that arrives at a receiver
// beside it left a little earlier or later.
struct ListenerFrame {
  Vec3 centre_m{};
  std::array<Vec3, kEars> ear_positions_m{};
  Vec3 ahead{}, left{}, up{};
  int places = kEars;  // distinct receiver positions
  bool operator==(const ListenerFrame&) const = default;
};

// Computes the listener-dependent columns of the table for slots `first` to `last`, both multiples
// of a tile, or only delays, distances and directions. `itd_table` adds an ITD and needs one
// receiver position.
void place_voices(VoiceTable& table, const ListenerFrame& listener, const ItdTable* itd_table,
                  std::size_t first, std::size_t last, bool delays_only = false);

// A source in uniform motion around the moment when it was at a position. Ages and speeds are in
// metres that sound travels.
struct MovingSourcePoint {
  Vec3f position_m{};
  Vec3f mach{};
  double age_m = 0;  // time from then until it is heard; irrelevant for a source at rest

  // Time by which the sound that arrives at `place` left the source later, as a path: the earlier
  // solution of age_m - later = |place - position_m - later x mach|.
  double later_m(const Vec3& place) const;
};

// Direction and delay of one source, which need not be in the table, with the same bits.
Vec3f direction_from(const ListenerFrame& listener, const Vec3f& position_m);
double delay_frames(const VoiceTable& table, const ListenerFrame& listener,
                    const ItdTable* itd_table, const MovingSourcePoint& source,
                    double emission_frames, int ear);

// Writes the delays, gains and direction of voices[slot - first] for slots that have been placed.
void make_voices(const VoiceTable& table, int places, std::span<const std::uint32_t> slots,
                 Voice* voices, std::size_t first = 0);

// The frame of a listener with two receivers, kEarDistance_m apart, or one in the centre.
inline constexpr double kEarDistance_m = 0.17;
enum class Receivers : std::uint8_t { kPair, kOne };
ListenerFrame listener_frame(const Listener& listener, Receivers receivers);

}  // namespace clamor
