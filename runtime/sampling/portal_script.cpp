#include "runtime/sampling/portal_script.h"

#include <algorithm>

#include "formats/bake_file/baked_portals.h"

namespace clamor {

namespace {

constexpr double kMaxPortalTime_s = 1e7;
constexpr const char* kExpectedPoints =
    "'openness' must be a list of [time_s, openness], times ascending from 0 on, openness 0 to 1";

}  // namespace

Result<PortalScript> PortalScript::parse(const Json& list, const std::string& where) {
  if (list.array() == nullptr)
    return Error(where +
                 ": 'portals' must be a list, [ { \"name\": ..., \"openness\": "
                 "[[time_s, value], ...] }, ... ].");
  PortalScript script;
  for (const Json& item : *list.array()) {
    Scripted scripted;
    scripted.where = where + ": portal " + std::to_string(script.portals_.size() + 1);
    JsonFields fields(item, scripted.where);
    const auto name = fields.string("name");
    if (!name) fields.fail("'name' is missing: give that of a portal of the level");
    const Json* points = fields.any("openness");
    const bool is_list =
        points != nullptr && points->array() != nullptr && !points->array()->empty();
    if (!is_list) fields.fail(kExpectedPoints);
    fields.any("comment");
    if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
    double last_s = 0;
    for (const Json& point : *points->array()) {
      const bool is_pair = point.array() != nullptr && point.array()->size() == 2;
      const double* time_s = is_pair ? (*point.array())[0].number() : nullptr;
      const double* openness = is_pair ? (*point.array())[1].number() : nullptr;
      if (time_s == nullptr || openness == nullptr ||
          !(*time_s >= last_s && *time_s <= kMaxPortalTime_s) ||
          !(*openness >= 0 && *openness <= 1))
        return Error(scripted.where + ": " + kExpectedPoints + ".");
      last_s = *time_s;
      scripted.points.push_back({*time_s, *openness});
    }
    scripted.name = *name;
    script.portals_.push_back(std::move(scripted));
  }
  return script;
}

Result<void> PortalScript::find(std::span<const Portal> portals) {
  portals_of_level_ = portals.size();
  for (Scripted& scripted : portals_) {
    scripted.portals.clear();
    for (std::size_t p = 0; p < portals.size(); ++p)
      if (portals[p].name == scripted.name) scripted.portals.push_back(p);
    if (scripted.portals.empty())
      return Error(scripted.where + ": no portal of the level is named " +
                   in_quotes(scripted.name) + "; 'clamor inspect' lists them.");
  }
  return {};
}

std::vector<float> PortalScript::openness(double time_s) const {
  std::vector<float> openness(portals_of_level_, kOpenedByParts);
  for (const Scripted& scripted : portals_) {
    const auto& points = scripted.points;
    const auto after =
        std::upper_bound(points.begin(), points.end(), time_s,
                         [](double time, const Point& point) { return time < point.time_s; });
    double value = after == points.begin() ? after->openness : (after - 1)->openness;
    if (after != points.begin() && after != points.end())
      value += (after->openness - value) * (time_s - (after - 1)->time_s) /
               (after->time_s - (after - 1)->time_s);
    for (const std::size_t portal : scripted.portals) openness[portal] = static_cast<float>(value);
  }
  return openness;
}

}  // namespace clamor
