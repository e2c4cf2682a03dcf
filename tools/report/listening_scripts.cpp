#include "tools/report/listening_scripts.h"

#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "embedded_page.h"
#include "formats/files/level_folder.h"
#include "tools/analysis/json_values.h"

namespace clamor {

namespace {

// A module's text without its imports and exports, so that several are one classic script, which a
// page from a disk can give to a Worker.
std::string without_imports(std::string_view text) {
  std::string result;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    if (line.starts_with("import ") || line.starts_with("export {") ||
        line.starts_with("export default "))
      continue;
    if (line.starts_with("export ")) line.remove_prefix(std::string_view("export ").size());
    result += std::string(line) + '\n';
  }
  constexpr std::string_view kModuleUrl = "import.meta.url";
  for (std::size_t at = 0; (at = result.find(kModuleUrl, at)) != std::string::npos;)
    result.replace(at, kModuleUrl.size(), "location.href");
  return result;
}

std::string element(const std::string& id, std::string_view text) {
  return fmt::format("<script type=\"text/plain\" id=\"listen-{}\">{}</script>\n", id, text);
}

}  // namespace

Result<std::string> listening_scripts(const std::string& player, const std::string& bake,
                                      const std::string& other) {
  const auto part = [&](const std::string& name) {
    auto bytes = read_whole_file(player + "/" + name);
    if (bytes.ok()) return bytes;
    return decltype(bytes)(Error(bytes.error().message +
                                 " --listen takes the folder of the package @clamor/player, which "
                                 "tools/bundle --wasm builds in build/wasm/package."));
  };
  const auto modules = [&](std::initializer_list<const char*> names) -> Result<std::string> {
    std::string text;
    for (const char* name : names) {
      const auto bytes = part(name);
      if (!bytes.ok()) return bytes.error();
      text += without_imports({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
    }
    return text;
  };
  auto worker =
      modules({"clamor.mjs", "declarations.js", "native.js", "remote_bake.js", "worker.js"});
  if (!worker.ok()) return worker;
  auto worklet = modules({"worklet.js"});
  if (!worklet.ok()) return worklet;
  auto page = modules({"player.js"});
  if (!page.ok()) return page;
  const auto wasm = part("clamor.wasm");
  if (!wasm.ok()) return wasm.error();
  std::string elements =
      element("worker", *worker) + element("worklet", *worklet) + element("wasm", column(*wasm));
  for (const auto& [id, path] : {std::pair("bake", bake), std::pair("other", other)}) {
    if (path.empty()) continue;
    const auto baked = read_whole_file(path);
    if (!baked.ok()) return baked.error();
    elements += element(id, column(*baked));
  }
  return elements + "<script type=\"module\">\n" + *page + kListenScript + "</script>";
}

}  // namespace clamor
