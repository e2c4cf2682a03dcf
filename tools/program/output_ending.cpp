#include "tools/program/output_ending.h"

#include <fmt/format.h>

#include "common/text.h"
#include "formats/files/output_target.h"

namespace clamor {

Result<void> check_ending(const std::string& path, std::string_view ending, std::string_view kind) {
  if (path.size() > ending.size() &&
      equal_ignoring_case(std::string_view(path).substr(path.size() - ending.size()), ending))
    return {};
  if (const auto target = OutputTarget::find(path); target.ok() && target->is_stream()) return {};
  return Error(fmt::format("-o: cannot write {}: {} end in {}", in_quotes(path), kind, ending));
}

}  // namespace clamor
