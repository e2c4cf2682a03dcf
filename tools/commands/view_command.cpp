// view_command.cpp: clamor view: a window to walk in, listen and edit.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "common/utf8_path.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/commands.h"
#include "tools/commands/sound_options.h"
#include "tools/program/arguments.h"
#include "tools/program/output_ending.h"
#include "tools/view/view_script.h"
#include "tools/view/view_session.h"
#ifdef CLAMOR_HAS_WINDOW
#include "tools/view/window/view_window.h"
#endif

namespace clamor {

namespace {

struct ViewRequest {
  std::string script;
  double scale = 0;
  ViewOptions options;
};

#ifdef CLAMOR_HAS_WINDOW

std::string read_whole(const std::string& path) {
  std::ifstream file(path_of(path), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Returns the request that made the bake, if the level lies beside it.
std::optional<BakeRequest> request_of(const BakeFile& bake) {
  const Provenance& made = bake.provenance();
  const auto level = path_of(bake.path()).parent_path() / path_of(made.level);
  std::error_code none;
  if (!std::filesystem::exists(level, none)) return std::nullopt;
  std::string note = level.string();
  for (const std::string& word : made.arguments) note += '\0' + word;
  return request_from_note(note);
}

Result<void> read_files(ViewRequest& request, const MixArguments& mix,
                        const OutputArguments& output) {
  ViewOptions& options = request.options;
  InputFiles inputs;
  inputs.add(options.path);
  inputs.add(options.compare);
  if (const auto read = output.read_head(options.player.auralizer.output, inputs); !read.ok())
    return read.error();
  for (const std::string& target : {options.player.record, options.output})
    if (!target.empty())
      if (const auto safe = OutputTarget::find(target, inputs); !safe.ok()) return safe.error();
  options.access = mix.access();
  options.made_by = request_of;
  return {};
}

Result<void> run_window(ViewRequest& request, const MixArguments& mix,
                        const OutputArguments& output, std::ostream& out) {
  if (auto read = read_files(request, mix, output); !read.ok()) return read;
  WindowOptions window;
  window.scale = request.scale;
  if (!request.script.empty()) {
    std::error_code none;
    if (!std::filesystem::exists(path_of(request.script), none))
      return Error(request.script + ": no such file");
    auto events = parse_view_script(read_whole(request.script));
    if (!events.ok()) return events.error().in(request.script);
    window.script = std::move(*events);
  }
  for (const ViewEvent& event : window.script)
    if (event.kind == ViewEvent::Kind::kSize) {
      window.width = static_cast<int>(event.x);
      window.height = static_cast<int>(event.y);
      break;
    }
  auto session = ViewSession::open(request.options);
  if (!session.ok()) return session.error();
  return run_view_window(**session, window, out);
}

#else

Result<void> run_window(ViewRequest&, const MixArguments&, const OutputArguments&, std::ostream&) {
  return Error(
      "this program was built without the window. On Debian or Ubuntu, install libglfw3-dev, "
      "libimgui-dev and libgl-dev, and build again: cmake --preset release && cmake --build "
      "--preset release --target clamor. 'clamor play' walks through a bake in a terminal.");
}

#endif

}  // namespace

int run_view(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  ViewRequest request;
  ViewOptions& options = request.options;
  std::optional<Listener> at;
  Arguments parser("view",
                   "Opens a window to walk through a level or a bake, to listen, and to edit "
                   "materials and emitters; the level is baked again in the background after each "
                   "edit. Edits are saved to LEVEL.acoustics.json, never to the level.",
                   "clamor view hall.glb --emitter \"name=violin,signal=violin.flac,at=1,1.2,-3\"");
  parser.positional("file", options.path, "a level, .gltf or .glb, or a bake file");
  parser.option("-o,--output", options.output,
                "also write the bake of the saved level to this file");
  parser.option("--compare", options.compare, "another bake, to switch to at the same place");
  parser.listener(
      "--listener", options.listener,
      "start position X,Y,Z[,YAW[,PITCH]] in metres and degrees [unset: in front of the first "
      "emitter]");
  parser.listener("--at", at, "place X,Y,Z to look at and to mark, as bake and inspect print it");
  parser.option("--threads", options.threads, "threads of bakes, 0: all cores");
  parser.option("--scale", request.scale,
                "size of texts and panels, as in 1.5 [0: that of the monitor]");
  parser.option("--script", request.script,
                "play input events from this file, as tools/view/view_script.h describes them");
  add_bake_options(parser, options.request);
  MixArguments mix(parser, options.player.auralizer);
  DeviceArguments device(options.player);
  device.add_device_options(parser);
  device.add_recording_options(parser);
  OutputArguments output(parser, options.player.auralizer.output);
  parser.then([&]() -> Result<void> {
    if (const auto complaint = options.request.complaint()) return Error(*complaint);
    if (!(request.scale == 0 || (request.scale >= 0.5 && request.scale <= 4)))
      return Error("--scale must lie between 0.5 and 4");
    if (auto right = device.interpret(); !right.ok() || options.output.empty()) return right;
    return check_ending(options.output, ".clamor", "bake files");
  });
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  options.strategy = mix.strategy();
  if (at) options.at_m = at->position_m;
  return parser.end(err, run_window(request, mix, output, out));
}

}  // namespace clamor
