#include "bake/report/coincident_emitters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>

#include <fmt/format.h>

#include "common/maths.h"
#include "common/result.h"
#include "common/sample_rate.h"
#include "formats/level/emitter.h"

namespace clamor {

namespace {

constexpr double kDecibelsOfTwo = 3.010299956639812;  // of a factor of two in power
constexpr double kSamePlace_m = 1e-3;
constexpr double kWorthSaying_db = 1;
constexpr std::size_t kMostSentences = 3;

struct Group {
  const Emitter* first = nullptr;
  std::size_t count = 0;
  double amplitude = 0, power = 0;

  double excess_db() const {
    return power > 0 ? kDecibelsOfTwo * log2_of(amplitude * amplitude / power) : 0;
  }
};

}  // namespace

std::vector<std::string> coincident_emitters(std::span<const Emitter> emitters,
                                             const Vec3& origin_m) {
  using Key = std::array<std::int64_t, 5>;  // place, signal, start
  std::map<Key, Group> groups;
  for (const Emitter& emitter : emitters) {
    const Vec3 place = emitter.position_m / kSamePlace_m;
    Group& group = groups[{std::llround(place.x), std::llround(place.y), std::llround(place.z),
                           emitter.signal, std::llround(emitter.delay_s * kSampleRate_hz)}];
    if (group.count++ == 0) group.first = &emitter;
    group.amplitude += emitter.gain;
    group.power += emitter.gain * emitter.gain;
  }
  std::vector<Group> loud;
  for (const auto& [key, group] : groups)
    if (group.excess_db() > kWorthSaying_db) loud.push_back(group);
  std::ranges::stable_sort(loud, std::greater(), &Group::excess_db);
  std::vector<std::string> sentences;
  for (const Group& group : loud) {
    const Vec3 at_m = group.first->position_m + origin_m;
    sentences.push_back(fmt::format(
        "{} emitters sound alike at one place and time, ({:.1f}, {:.1f}, {:.1f}), the first of "
        "them {}: their direct sound adds up in amplitude, but their reflections in power, so that "
        "the direct sound is {:.1f} dB too loud; make them one emitter of gain x{:.3g}, or give "
        "them other places or starts",
        group.count, at_m.x, at_m.y, at_m.z, in_quotes(group.first->name), group.excess_db(),
        group.amplitude));
    if (sentences.size() == kMostSentences) break;
  }
  return sentences;
}

}  // namespace clamor
