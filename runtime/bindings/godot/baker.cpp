#include "runtime/bindings/godot/baker.h"

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <clamor_bake.h>

#include "common/platform/process.h"
#include "runtime/bindings/godot/world.h"

namespace clamor::godot {
namespace {

using Arguments = const Value* const*;

// Functions of libclamor_bake.
struct BakeLibrary {
  decltype(&clamor_bake_read_level) read_level;
  decltype(&clamor_bake_to_file) bake;
  decltype(&clamor_bake_destroy_level) destroy_level;
  std::string error;
};

const BakeLibrary& bake_library() {
  static const BakeLibrary library = [] {
    BakeLibrary loaded{};
    void* const file = loaded_library(
        {library_path("libclamor_bake.so.0").c_str(), library_path("libclamor_bake.dll").c_str()});
    if (file == nullptr) {
      loaded.error = "The library libclamor_bake cannot be loaded. It must lie in " +
                     library_path("") + ", as the add-on's archive has it.";
      return loaded;
    }
    const auto load = [&](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(symbol_in(file, name));
    };
    load(loaded.read_level, "clamor_bake_read_level");
    load(loaded.bake, "clamor_bake_to_file");
    load(loaded.destroy_level, "clamor_bake_destroy_level");
    return loaded;
  }();
  return library;
}

// The bake under way, or the last one.
struct Bake {
  std::thread thread;
  std::atomic<bool> is_running = false, is_cancelled = false;
  std::mutex writing;  // of the members below
  clamor_bake_progress progress{};
  std::vector<std::pair<std::uint32_t, std::string>> messages;
  std::string error;
};

Bake& bake_under_way() {
  static auto* bake = new Bake;
  return *bake;
}

void run_bake(const std::string& level_path, const std::string& output, std::uint64_t sources,
              double probe_spacing_m) {
  Bake& bake = bake_under_way();
  clamor_bake_level* level = nullptr;
  clamor_bake_error error{};
  auto result = bake_library().read_level(level_path.c_str(), nullptr, &level, &error);
  if (result == CLAMOR_BAKE_OK) {
    auto options = sized<clamor_bake_options>();
    options.sources = sources;
    options.probe_spacing_m = probe_spacing_m;
    options.user = &bake;
    options.progress = [](void* user, const clamor_bake_progress* progress) -> std::int32_t {
      auto& told = *static_cast<Bake*>(user);
      const std::lock_guard lock(told.writing);
      told.progress = *progress;
      return told.is_cancelled;
    };
    options.message = [](void* user, std::uint32_t kind, const char* sentence) {
      auto& told = *static_cast<Bake*>(user);
      const std::lock_guard lock(told.writing);
      told.messages.emplace_back(kind, sentence);
    };
    result = bake_library().bake(level, &options, output.c_str(), nullptr, &error);
    bake_library().destroy_level(level);
  }
  const std::lock_guard lock(bake.writing);
  if (result != CLAMOR_BAKE_OK) bake.error = error.sentence;
  bake.is_running = false;
}

// Bakes a glTF level into a file. Empty, or why no bake was begun.
Value start_bake(void*, Arguments a) {
  Bake& bake = bake_under_way();
  if (bake.is_running) return "A bake is under way already.";
  if (!bake_library().error.empty()) return bake_library().error;
  if (bake.thread.joinable()) bake.thread.join();
  bake.is_cancelled = false;
  bake.is_running = true;
  bake.progress = {};
  bake.messages.clear();
  bake.error.clear();
  bake.thread = std::thread(run_bake, a[0]->to_text(), a[1]->to_text(),
                            std::uint64_t(a[2]->to_int()), a[3]->to_float());
  return "";
}

Value bake_status(void*, Arguments) {
  Bake& bake = bake_under_way();
  const std::lock_guard lock(bake.writing);
  const Value warnings = Value::empty(kArray), notes = Value::empty(kArray);
  for (const auto& [kind, sentence] : bake.messages)
    (kind == CLAMOR_BAKE_WARNING ? warnings : notes).call("append", {sentence});
  Value status = Value::empty(kDictionary);
  status.set("running", bake.is_running.load());
  status.set("fraction", bake.progress.fraction);
  status.set("seconds", bake.progress.seconds);
  status.set("warnings", warnings);
  status.set("notes", notes);
  status.set("error", bake.error);
  return status;
}

Value cancel_bake(void*, Arguments) {
  bake_under_way().is_cancelled = true;
  return {};
}

}  // namespace

std::vector<Method> baker_methods() {
  return {
      {"start_bake",
       "Bakes a glTF file into a [code].clamor[/code] file, in the background. Returns why it "
       "cannot, or nothing.",
       kString,
       {{"level_path", kString},
        {"output_path", kString},
        {"sources", kInt},
        {"probe_spacing_m", kFloat}},
       start_bake},
      {"get_bake_status",
       "How far the bake is, and what it has found: [code]running[/code], [code]fraction[/code], "
       "[code]seconds[/code], [code]warnings[/code], [code]notes[/code] and [code]error[/code].",
       kDictionary,
       {},
       bake_status},
      {"cancel_bake", "Ends the bake that is under way.", kNil, {}, cancel_bake}};
}

void end_baker() {
  bake_under_way().is_cancelled = true;
  if (bake_under_way().thread.joinable()) bake_under_way().thread.join();
}

}  // namespace clamor::godot
