// screenshot.h: writes the picture of the window to a file.
#pragma once

#include <string>

#include "common/result.h"

namespace clamor {

// Reads the frame buffer of the current OpenGL context and writes a .png or .ppm file.
Result<void> write_screenshot(const std::string& path, int width, int height);

}  // namespace clamor
