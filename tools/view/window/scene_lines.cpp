#include "tools/view/window/scene_lines.h"

#include <numeric>

#include "tools/view/door_shapes.h"

namespace clamor {

std::vector<SceneLines> scene_lines(const ViewSession& session) {
  constexpr Vec3f kPortal(0.38f, 0.62f, 1.0f), kSelected(1.0f, 0.62f, 0.18f);
  using Kind = Selection::Kind;
  const Selection& chosen = session.selection();
  std::vector<SceneLines> lines;
  for (std::size_t p = 0; p < session.portals().size(); ++p)
    lines.push_back({lines_of(session.portals()[p], session.doors().portals()[p].openness),
                     chosen.kind == Kind::kPortal && chosen.index == p ? kSelected : kPortal});
  if (chosen.kind == Kind::kSurface) lines.push_back({session.outline(), kSelected});
  if (chosen.kind == Kind::kPart) {
    const Mesh part = session.part_mesh(chosen.index);
    std::vector<std::uint32_t> all(part.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    lines.push_back({outline_of(part, all), kSelected});
  }
  return lines;
}

}  // namespace clamor
