#include "formats/bake_file/bake_root_portals.h"

#include <cmath>

#include "formats/bake_file/bake_root_values.h"
#include "formats/bake_file/value_limits.h"
#include "formats/level/movable_part.h"

namespace clamor {

namespace {

// Virtual emitters need not be more than sources.
constexpr std::size_t kMaxPortalEmitters = 1 << 24;

using bake_root::read_vector;
using bake_root::write_vector;

}  // namespace

Result<void> check_portals(const BakedPortals& portals, std::size_t emitters,
                           std::size_t movable_parts) {
  if (portals.portals.size() > kMaxPortals) return Error("it has more than 1024 portals");
  if (portals.sets.size() > kMaxPortalSets) return Error("it has more than 2048 sets of portals");
  for (const Portal& portal : portals.portals) {
    if (!is_rectangle(portal))
      return Error("portal " + in_quotes(portal.name) + " is not a rectangle");
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(portal.centre_m[axis]) <= kMaxCoordinateInFile_m))
        return Error("portal " + in_quotes(portal.name) + " lies outside the coordinate range");
    for (const std::uint16_t part : portal.parts)
      if (part >= movable_parts)
        return Error("portal " + in_quotes(portal.name) +
                     " names a movable part that does not exist");
  }
  if (portals.sets.empty() != portals.portals.empty() ||
      (!portals.sets.empty() && !portals.sets[0].is_empty()))
    return Error("its sets of portals do not begin with the empty one");
  for (const PortalSet& set : portals.sets)
    if (!set.is_valid(portals.portals.size())) return Error("a set of portals is out of range");
  for (const PortalEmitter& one : portals.emitters)
    if (one.emitter >= emitters || one.set >= portals.sets.size())
      return Error("a virtual emitter names an emitter or a set of portals that does not exist");
  return {};
}

Result<BakedPortals> read_portals(BakeRoot::Reader root, std::size_t emitters,
                                  std::size_t movable_parts) {
  BakedPortals portals;
  const auto stored = root.getPortals();
  if (stored.getPortals().size() > kMaxPortals) return Error("it has more than 1024 portals");
  for (const auto one : stored.getPortals()) {
    Portal& portal = portals.portals.emplace_back();
    portal.name = bake_root::name(one.getName());
    const auto centre = read_vector(one.getCentreM(), "a portal");
    const auto half_u = read_vector(one.getHalfUM(), "a portal"),
               half_v = read_vector(one.getHalfVM(), "a portal");
    for (const auto* vector : {&centre, &half_u, &half_v})
      if (!vector->ok()) return vector->error();
    portal.centre_m = *centre;
    portal.half_u_m = *half_u;
    portal.half_v_m = *half_v;
    portal.is_baked_closed = one.getBakedClosed();
    if (one.getParts().size() > kMaxMovableParts) return Error("a portal has too many parts");
    for (const std::uint16_t part : one.getParts()) portal.parts.push_back(part);
  }
  if (stored.getSets().size() > kMaxPortalSets)
    return Error("it has more than 2048 sets of portals");
  for (const auto list : stored.getSets()) {
    PortalSet& set = portals.sets.emplace_back();
    if (list.size() > set.numbers.size()) return Error("a set has more than four portals");
    for (unsigned i = 0; i < list.size(); ++i) {
      if (list[i] == 0xffff) return Error("a set names a portal that does not exist");
      set.numbers[i] = static_cast<std::uint16_t>(list[i] + 1);
    }
  }
  const auto emitter = stored.getEmitters();
  const auto set = stored.getEmitterSets();
  if (emitter.size() != set.size() || emitter.size() > kMaxPortalEmitters)
    return Error("its virtual emitters are out of range");
  for (unsigned i = 0; i < emitter.size(); ++i) portals.emitters.push_back({emitter[i], set[i]});
  if (const auto done = check_portals(portals, emitters, movable_parts); !done.ok())
    return done.error();
  return portals;
}

void write_portals(BakeRoot::Builder root, const BakedPortals& portals) {
  if (portals.portals.empty()) return;
  auto stored = root.initPortals();
  auto list = stored.initPortals(static_cast<unsigned>(portals.portals.size()));
  for (unsigned i = 0; i < list.size(); ++i) {
    const Portal& portal = portals.portals[i];
    list[i].setName(portal.name);
    write_vector(list[i].initCentreM(3), portal.centre_m);
    write_vector(list[i].initHalfUM(3), portal.half_u_m);
    write_vector(list[i].initHalfVM(3), portal.half_v_m);
    list[i].setBakedClosed(portal.is_baked_closed);
    if (portal.parts.empty()) continue;
    auto parts = list[i].initParts(static_cast<unsigned>(portal.parts.size()));
    for (unsigned p = 0; p < parts.size(); ++p) parts.set(p, portal.parts[p]);
  }
  auto sets = stored.initSets(static_cast<unsigned>(portals.sets.size()));
  for (unsigned s = 0; s < sets.size(); ++s) {
    const PortalSet& set = portals.sets[s];
    auto indices = sets.init(s, static_cast<unsigned>(set.size()));
    for (unsigned i = 0; i < indices.size(); ++i)
      indices.set(i, static_cast<std::uint16_t>(set.numbers[i] - 1));
  }
  const auto count = static_cast<unsigned>(portals.emitters.size());
  auto emitters = stored.initEmitters(count);
  auto emitter_sets = stored.initEmitterSets(count);
  for (unsigned i = 0; i < count; ++i) {
    emitters.set(i, portals.emitters[i].emitter);
    emitter_sets.set(i, static_cast<std::uint16_t>(portals.emitters[i].set));
  }
}

}  // namespace clamor
