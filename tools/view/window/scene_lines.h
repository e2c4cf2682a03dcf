// scene_lines.h: the lines that the window draws in the level: the outline of what is selected, and
// portals, as far open as they are.
#pragma once

#include <vector>

#include "tools/view/view_session.h"
#include "tools/view/window/scene_renderer.h"

namespace clamor {

std::vector<SceneLines> scene_lines(const ViewSession& session);

}  // namespace clamor
