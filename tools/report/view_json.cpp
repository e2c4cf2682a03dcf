#include "tools/report/view_json.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "bake/mesh/mesh_preparation.h"
#include "common/bounds.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/source_octree.h"
#include "formats/level/movable_part.h"
#include "tools/analysis/json_values.h"
#include "tools/report/bake_overview.h"

namespace clamor {

namespace {

void put(std::vector<float>& column, const Vec3f& v) {
  column.insert(column.end(), {v.x, v.y, v.z});
}

// A number with as many digits as a reader of the map sees.
OrderedJson rounded(const std::optional<double>& value) {
  if (!value) return nullptr;
  return std::round(*value * 1000) / 1000;
}

Boundsf extent_of(const Room& room) {
  if (!room.mesh.vertices_m.empty()) return bounds_of(room.mesh.vertices_m);
  if (!room.sources.empty()) return bounds_of(room.sources, &Source::position_m);
  return {Vec3f(0), Vec3f(0)};
}

// Vertices in 65535 steps of the extent; of many triangles the largest.
OrderedJson mesh_of(const Room& room, const Boundsf& extent, std::size_t max_triangles) {
  std::vector<std::size_t> kept(room.mesh.triangles.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (kept.size() > max_triangles) {
    std::vector<double> areas(kept.size());
    for (std::size_t t = 0; t < areas.size(); ++t) areas[t] = area_m2(room.mesh, t);
    std::stable_sort(kept.begin(), kept.end(),
                     [&](std::size_t a, std::size_t b) { return areas[a] > areas[b]; });
    kept.resize(max_triangles);
    std::sort(kept.begin(), kept.end());
  }
  const Vec3f size_m = glm::max(extent.high_m - extent.low_m, Vec3f(1e-6f));
  constexpr std::uint32_t kUnused = 0xffffffff;
  std::vector<std::uint32_t> number(room.mesh.vertices_m.size(), kUnused), corners;
  std::vector<std::uint16_t> vertices, materials;
  std::uint32_t count = 0;
  for (const std::size_t t : kept) {
    for (const std::uint32_t corner : room.mesh.triangles[t]) {
      if (number[corner] == kUnused) {
        number[corner] = count++;
        for (int axis = 0; axis < 3; ++axis) {
          const float share =
              (room.mesh.vertices_m[corner][axis] - extent.low_m[axis]) / size_m[axis];
          vertices.push_back(static_cast<std::uint16_t>(std::lround(share * 65535)));
        }
      }
      corners.push_back(number[corner]);
    }
    materials.push_back(room.mesh.materials[t]);
  }
  OrderedJson json = {{"low", as_json(Vec3(extent.low_m))},
                      {"size", as_json(Vec3(size_m))},
                      {"total", room.mesh.triangles.size()},
                      {"vertices", column(vertices)},
                      {"materials", column(materials)}};
  if (count < 65536)
    json["corners16"] = column(std::vector<std::uint16_t>(corners.begin(), corners.end()));
  else
    json["corners32"] = column(corners);
  return json;
}

OrderedJson materials_of(const std::vector<Material>& materials) {
  OrderedJson list = OrderedJson::array();
  for (const Material& material : materials)
    list.push_back({{"name", material.name}, {"absorption", material.absorption}});
  return list;
}

// Emitters by name, without the number of each.
class EmitterKinds {
 public:
  std::uint16_t kind_of(const Emitter& emitter) {
    const auto next = static_cast<std::uint16_t>(list_.size());
    const auto [found, is_new] = known_.try_emplace(without_number(emitter.name), next);
    if (is_new) list_.push_back({{"name", found->first}});
    return found->second;
  }
  OrderedJson json() const { return list_; }

 private:
  std::map<std::string, std::uint16_t> known_;
  OrderedJson list_ = OrderedJson::array();
};

// The reflections that the view holds: at most `count` of highest key, as indices of Room::sources.
std::vector<std::size_t> held_sources(const Room& room, std::size_t count) {
  std::vector<std::size_t> held;
  for (std::size_t i = 0; i < room.sources.size(); ++i)
    if (!room.sources[i].is_image && !room.sources[i].is_emitter) held.push_back(i);
  if (held.size() <= count) return held;
  const auto key = [&](std::size_t i) { return octree_key(room.sources[i]); };
  std::nth_element(
      held.begin(), held.begin() + static_cast<std::ptrdiff_t>(count), held.end(),
      [&](std::size_t a, std::size_t b) { return key(a) != key(b) ? key(a) > key(b) : a < b; });
  held.resize(count);
  std::sort(held.begin(), held.end());
  return held;
}

OrderedJson sources_of(const Room& room, std::size_t count, EmitterKinds& kinds) {
  const std::vector<std::size_t> held = held_sources(room, count);
  std::vector<float> places, delays;
  std::vector<std::uint8_t> powers;
  std::vector<std::uint16_t> materials, of_kind;
  float top = 0;
  for (const std::size_t i : held)
    for (const float power : room.sources[i].power) top = std::max(top, power);
  for (const std::size_t i : held) {
    const Source& source = room.sources[i];
    put(places, source.position_m);
    for (const float power : source.power) {
      // Half decibels below the highest power, as the file has them; 255 is silence.
      const double step =
          power > 0 ? std::round(-20 * std::log10(static_cast<double>(power) / top)) : 255;
      powers.push_back(static_cast<std::uint8_t>(std::min(step, 255.0)));
    }
    delays.push_back(source.delay_s);
    materials.push_back(source.material);
    of_kind.push_back(kinds.kind_of(
        room.playing[room.playing_of.size() > i ? room.playing_of[i] : source.emitter]));
  }
  return {{"total", room.file->source_count() - room.emitters().size()},
          {"held", held.size()},
          {"top", top},
          {"places", column(places)},
          {"powers", column(powers)},
          {"delays", column(delays)},
          {"materials", column(materials)},
          {"kinds", column(of_kind)}};
}

OrderedJson emitters_of(const Room& room, std::size_t max_emitters, EmitterKinds& kinds) {
  std::vector<float> places;
  std::vector<std::uint16_t> of_kind;
  const std::vector<Emitter>& emitters = room.emitters();
  const std::size_t shown = std::min(emitters.size(), max_emitters);
  OrderedJson names = OrderedJson::array();
  for (std::size_t e = 0; e < shown; ++e) {
    put(places, Vec3f(emitters[e].position_m));
    put(places, Vec3f(emitters[e].axis));
    of_kind.push_back(kinds.kind_of(emitters[e]));
    if (emitters.size() <= 64) names.push_back(emitters[e].name);
  }
  return {{"total", emitters.size()},
          {"names", names},
          {"places", column(places)},
          {"kinds", column(of_kind)}};
}

// Whole depths of the level's own tree, as far as the limit reaches.
Result<OrderedJson> nodes_of(const BakeFile& file, std::size_t max_nodes) {
  OrderedJson json = {{"depths", 0}, {"shown", 0}};
  if (file.top() == nullptr) return json;
  std::vector<float> boxes;
  std::vector<std::uint8_t> depths;
  std::vector<PageEntry> level = {*file.top()};
  std::size_t depth = 0;
  for (; !level.empty() && depths.size() + level.size() <= max_nodes && depth < 255; ++depth) {
    std::vector<PageEntry> below;
    for (const PageEntry& entry : level) {
      put(boxes, entry.low_m);
      put(boxes, entry.high_m);
      depths.push_back(static_cast<std::uint8_t>(depth));
      const auto page = file.read_page(entry);
      if (!page.ok()) return page.error();
      below.insert(below.end(), page->links.children.begin(), page->links.children.end());
    }
    level = std::move(below);
  }
  json["depths"] = file.depths().back().size();
  json["shown"] = depth;
  json["boxes"] = column(boxes);
  json["of"] = column(depths);
  return json;
}

OrderedJson probes_of(const BakeFile& file) {
  std::vector<float> places;
  std::vector<std::uint16_t> zones;
  for (const StoredProbe& probe : file.probes().places) {
    put(places, Vec3f(probe.position_m));
    zones.push_back(static_cast<std::uint16_t>(probe.zone));
  }
  return {{"places", column(places)}, {"zones", column(zones)}};
}

OrderedJson portals_of(const BakeFile& file) {
  OrderedJson list = OrderedJson::array();
  for (const Portal& portal : file.portals().portals)
    list.push_back({{"name", portal.name},
                    {"centre", as_json(Vec3(portal.centre_m))},
                    {"u", as_json(Vec3(portal.half_u_m))},
                    {"v", as_json(Vec3(portal.half_v_m))},
                    {"parts", portal.parts},
                    {"baked_closed", portal.is_baked_closed}});
  return list;
}

// The boxes of movable parts at rest, along their own axes: half of their sides.
OrderedJson parts_of(const BakeFile& file) {
  OrderedJson list = OrderedJson::array();
  for (const MovablePart& part : file.movable_parts()) {
    const Boundsf own = bounds_of(part.mesh);
    const Vec3 half_m(0.5f * (own.high_m - own.low_m));
    const PartPose& pose = part.rest_pose;
    const Matrix axes = pose.scale * glm::mat3_cast(Quaternion(pose.rotation));
    list.push_back(
        {{"name", part.name},
         {"centre", as_json(pose.position_m + axes * Vec3(0.5f * (own.low_m + own.high_m)))},
         {"u", as_json(axes[0] * half_m.x)},
         {"v", as_json(axes[1] * half_m.y)},
         {"w", as_json(axes[2] * half_m.z)},
         {"materials", std::set(part.mesh.materials.begin(), part.mesh.materials.end())}});
  }
  return list;
}

OrderedJson findings_json(std::span<const LevelFinding> findings, const Vec3& origin_m) {
  OrderedJson list = OrderedJson::array();
  constexpr const char* kKinds[] = {"warning", "fact", "opening", "gap", "duplicate"};
  for (const LevelFinding& finding : findings) {
    OrderedJson one = {{"kind", kKinds[static_cast<std::size_t>(finding.kind)]},
                       {"text", finding.text}};
    if (finding.place_m) one["place"] = as_json(*finding.place_m - origin_m);
    one["size"] = finding.size_m;
    one["direction"] = as_json(finding.direction);
    list.push_back(std::move(one));
  }
  return list;
}

OrderedJson map_of(const FloorMap& map) {
  OrderedJson cells = OrderedJson::array();
  for (const MapCell& cell : map.cells) {
    OrderedJson values = OrderedJson::object();
    for (const ParameterKind& kind : kParameterKinds) {
      const std::string key = kind.key;
      if (key != "g_db" && key != "c80_db" && key != "t30_s") continue;
      OrderedJson bands = OrderedJson::array();
      for (const auto& value : cell.parameters.*kind.value) bands.push_back(rounded(value));
      values[key] = std::move(bands);
    }
    cells.push_back({cell.column, cell.row, cell.storey, rounded(cell.ear_m.x),
                     rounded(cell.ear_m.y), rounded(cell.ear_m.z), rounded(cell.floor_m),
                     std::move(values)});
  }
  return {{"step", map.step_m}, {"lowX", map.low_x_m}, {"lowZ", map.low_z_m}, {"cells", cells}};
}

}  // namespace

Result<OrderedJson> view_json(const Room& room, std::span<const LevelFinding> findings,
                              const FloorMap& map, std::span<const Vec3> listeners_m,
                              const ViewLimits& limits) {
  const BakeFile& file = *room.file;
  const Boundsf extent = extent_of(room);
  EmitterKinds kinds;
  OrderedJson json;
  json["origin"] = as_json(file.origin_m());
  json["low"] = as_json(Vec3(extent.low_m));
  json["high"] = as_json(Vec3(extent.high_m));
  json["bandsHz"] = kBandCentres_hz;
  json["mesh"] = mesh_of(room, extent, limits.triangles);
  json["materials"] = materials_of(file.materials());
  json["sources"] = sources_of(room, limits.sources, kinds);
  json["emitters"] = emitters_of(room, limits.emitters, kinds);
  json["kinds"] = kinds.json();
  auto nodes = nodes_of(file, limits.nodes);
  if (!nodes.ok()) return nodes.error();
  json["nodes"] = std::move(*nodes);
  json["probes"] = probes_of(file);
  json["portals"] = portals_of(file);
  json["parts"] = parts_of(file);
  json["findings"] = findings_json(findings, file.origin_m());
  json["map"] = map_of(map);
  json["listeners"] = OrderedJson::array();
  for (const Vec3& place_m : listeners_m) json["listeners"].push_back(as_json(place_m));
  return json;
}

}  // namespace clamor
