#include "bake/report/audibility_messages.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/result.h"
#include "formats/level/level_origin.h"

namespace clamor {

namespace {

constexpr std::size_t kShownEmitters = 3;

std::string width_in_words(double width_m) {
  return width_m < 0.995 ? fmt::format("{:.0f} cm", std::max(1.0, 100 * width_m))
                         : fmt::format("{:.1f} m", width_m);
}

std::string alternative_in_words(const InaudiblePlace& place, const Vec3& origin_m,
                                 const char* what) {
  if (!place.alternative_m) return "";
  return fmt::format("; the nearest place found {} is {}", what,
                     place_in_words(*place.alternative_m + origin_m));
}

std::string cause(const InaudiblePlace& place) {
  switch (place.why) {
    case InaudibleCause::kInSolid:
      return fmt::format(
          "inside a solid or a closed hollow, whose surfaces are {} apart on average",
          width_in_words(place.width_m));
    case InaudibleCause::kOutside:
      return "outside the level, which is closed";
    case InaudibleCause::kOnSurface:
      return "on a surface";
    case InaudibleCause::kFarAway:
      return "too far from every emitter";
    case InaudibleCause::kShutOff:
      break;
  }
  return "shut off from every emitter";
}

std::string emitter_in_words(const InaudiblePlace& place, const Vec3& origin_m,
                             const std::string& name) {
  if (place.why == InaudibleCause::kOnSurface)
    return fmt::format(
        "emitter {} lies on a surface, so half of its sound leaves on the far side{}",
        in_quotes(name), alternative_in_words(place, origin_m, "off it"));
  return fmt::format("emitter {} lies {}, so hardly any of its sound is heard {}{}",
                     in_quotes(name), cause(place),
                     place.why == InaudibleCause::kOutside ? "inside" : "elsewhere",
                     alternative_in_words(place, origin_m, "that works"));
}

}  // namespace

std::vector<std::string> in_words(std::span<const InaudibleEmitter> inaudible,
                                  std::span<const Emitter> emitters, const Vec3& origin_m) {
  std::vector<std::string> lines;
  for (const InaudibleEmitter& one : inaudible.first(std::min(inaudible.size(), kShownEmitters)))
    lines.push_back(emitter_in_words(one.place, origin_m, emitters[one.emitter].name));
  if (inaudible.size() > kShownEmitters)
    lines.push_back(fmt::format("{} more emitters lie inside solids, outside or on surfaces",
                                inaudible.size() - kShownEmitters));
  return lines;
}

std::string in_words(const InaudiblePlace& inaudible, const Vec3& listener_m,
                     std::span<const Emitter> emitters, const Vec3& origin_m) {
  // Some sound may pass the walls.
  const std::string where =
      "hardly anything is heard at " + place_in_words(listener_m + origin_m) + ": ";
  if (inaudible.emitter)
    return where + emitter_in_words(inaudible, origin_m, emitters[*inaudible.emitter].name);
  return where + "the listener is " + cause(inaudible) +
         alternative_in_words(inaudible, origin_m, "where an emitter is heard");
}

std::string probe_in_words(const InaudiblePlace& place, std::size_t number, const Vec3& probe_m,
                           const Vec3& origin_m) {
  const std::string probe =
      fmt::format("probe {} at {} lies ", number, place_in_words(probe_m + origin_m));
  if (place.why == InaudibleCause::kOnSurface)
    return probe + "on a surface, so half of its power leaves on the far side" +
           alternative_in_words(place, origin_m, "off it");
  return probe + cause(place) + ", so it serves no source " +
         (place.why == InaudibleCause::kOutside ? "inside" : "elsewhere") +
         alternative_in_words(place, origin_m, "that works");
}

}  // namespace clamor
