// view_window.h: the window of `clamor view`: GLFW and OpenGL 3.3 for pictures and input, Dear
// ImGui for panels.
#pragma once

#include <iosfwd>
#include <vector>

#include "common/result.h"
#include "tools/view/view_script.h"
#include "tools/view/view_session.h"

namespace clamor {

struct WindowOptions {
  int width = 1280, height = 720;  // in the system's units
  double scale = 0;                // of texts and panels; 0: the monitor's
  std::vector<ViewEvent> script;   // instead of a person, if there are any
};

// Runs the window until it is closed. Output of a script goes to `out`. Errors: no display, no
// OpenGL 3.3, a script that waits for what cannot come.
Result<void> run_view_window(ViewSession& session, const WindowOptions& options, std::ostream& out);

}  // namespace clamor
