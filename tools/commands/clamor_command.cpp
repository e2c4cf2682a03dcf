// clamor_command.cpp: selects and runs the subcommand.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ostream>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/text.h"
#include "common/version.h"
#include "tools/commands/commands.h"
#include "tools/program/printable_stream.h"

namespace clamor {

namespace {

constexpr std::string_view kHelp =
    R"(clamor: bakes the acoustics of a level and plays them back

  clamor bake LEVEL.gltf -o LEVEL.clamor    traces sound through a level and writes a bake file
  clamor merge SHARDS... -o LEVEL.clamor    joins the parts of a bake that several machines traced
  clamor inspect LEVEL.clamor               prints what a bake file holds
  clamor diff A.clamor B.clamor             prints how two bake files differ
  clamor play LEVEL.clamor                  plays a bake; the keyboard walks through it
  clamor render LEVEL.clamor -o OUT.wav     renders the same to a WAV or FLAC file
  clamor impulse LEVEL.clamor -o IR.wav     impulse response and room parameters (ISO 3382-1)
  clamor compare A.wav B.wav                audible differences between two recordings
  clamor experiment NAME LEVEL.clamor -o DIR  measures the paper's figures and claims again
  clamor materials                          lists the acoustic material presets
  clamor devices                            lists the sound devices that play can use
  clamor bench mixer                        measures how many voices this machine mixes

  clamor COMMAND --help                     options of one command
  clamor --version

example: clamor bake level.glb -o level.clamor --emitter "signal=noise,at=0,1.5,0" && clamor play level.clamor
)";

struct Command {
  std::string_view name;
  int (*run)(std::span<const std::string>, std::ostream&, std::ostream&);
};

constexpr std::array<Command, 12> kCommands = {{{"bake", run_bake},
                                                {"merge", run_merge},
                                                {"inspect", run_inspect},
                                                {"diff", run_diff},
                                                {"render", run_render},
                                                {"impulse", run_impulse},
                                                {"compare", run_compare},
                                                {"experiment", run_experiment},
                                                {"play", run_play},
                                                {"materials", run_materials},
                                                {"devices", run_devices},
                                                {"bench", run_bench}}};

int run_command(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  if (arguments.empty()) {
    err << kHelp;
    return kBadUsage;
  }
  const std::string& name = arguments[0];
  if (name == "--help" || name == "-h" || name == "help") {
    out << kHelp;
    return kSuccess;
  }
  if (name == "--version") {
    out << "clamor " << kVersion << '\n';
    return kSuccess;
  }
  std::vector<std::string> names;
  for (const Command& command : kCommands) {
    if (command.name == name) return command.run(arguments.subspan(1), out, err);
    names.emplace_back(command.name);
  }
  err << "clamor: there is no command " << in_quotes(name) << "; the nearest is "
      << in_quotes(nearest_name(name, names)) << "; see 'clamor --help'\n";
  return kBadUsage;
}

}  // namespace

int run_clamor(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  const PrintableStream printable_out(out), printable_err(err);
  const int code = run_command(arguments, out, err);
  errno = 0;
  out.flush();
  if (out) return code;
  // If an earlier write failed, errno no longer has its reason.
  err << "clamor: standard output could not be written"
      << (errno != 0 ? std::string(" (") + std::strerror(errno) + ")" : "")
      << ", so results are missing; free some space, or send them elsewhere\n";
  return code == kSuccess ? kBadInput : code;
}

}  // namespace clamor
