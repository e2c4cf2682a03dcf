#include "tools/view/window/screenshot.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <vector>

#include <GL/gl.h>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

namespace clamor {

Result<void> write_screenshot(const std::string& path, int width, int height) {
  const std::size_t row = static_cast<std::size_t>(width) * 3;
  std::vector<unsigned char> pixels(row * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  for (int y = 0; y < height / 2; ++y)  // OpenGL begins at the bottom
    std::swap_ranges(pixels.begin() + static_cast<std::ptrdiff_t>(row) * y,
                     pixels.begin() + static_cast<std::ptrdiff_t>(row) * (y + 1),
                     pixels.begin() + static_cast<std::ptrdiff_t>(row) * (height - 1 - y));
  bool is_written = false;
  if (path.ends_with(".ppm")) {
    std::ofstream file(path, std::ios::binary);
    file << "P6\n" << width << ' ' << height << "\n255\n";
    file.write(reinterpret_cast<const char*>(pixels.data()),
               static_cast<std::streamsize>(pixels.size()));
    is_written = file.good();
  } else if (path.ends_with(".png")) {
    is_written =
        stbi_write_png(path.c_str(), width, height, 3, pixels.data(), static_cast<int>(row)) != 0;
  } else {
    return Error(path + ": a screenshot is a .png or .ppm file");
  }
  if (!is_written) return Error(path + ": the screenshot cannot be written");
  return {};
}

}  // namespace clamor
