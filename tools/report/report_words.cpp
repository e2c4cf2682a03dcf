#include "tools/report/report_words.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "tools/report/bake_overview.h"

namespace clamor {

std::string file_name(const BakeFile& file) {
  return std::filesystem::path(file.path()).filename().string();
}

std::string place_text(const Vec3& place_m) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", place_m.x, place_m.y, place_m.z);
}

std::string listener_title(std::size_t index, const Vec3& place_m) {
  return fmt::format("Listener {} at {} m", index + 1, place_text(place_m));
}

std::string value_text(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::vector<std::string> band_columns(const std::string& first) {
  std::vector<std::string> columns = {first};
  for (std::size_t b = 0; b < kBandCount; ++b) columns.push_back(band_title(b));
  return columns;
}

std::string title_of(const ParameterKind& kind) {
  return kind.unit[0] != 0 ? fmt::format("{} ({})", kind.name, kind.unit) : kind.name;
}

const ParameterKind& kind_of(const char* name) {
  return *std::find_if(kParameterKinds.begin(), kParameterKinds.end(),
                       [&](const ParameterKind& kind) { return std::string(kind.name) == name; });
}

}  // namespace clamor
