// clamor_command.cpp: selects and runs the subcommand.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/result.h"
#include "common/text.h"
#include "common/version.h"
#include "tools/commands/commands.h"
#include "tools/program/interrupt.h"
#include "tools/program/terminal_output.h"

namespace clamor {

namespace {

struct Command {
  std::string_view name, operands, summary;
  int (*run)(std::span<const std::string>, std::ostream&, std::ostream&);
};

constexpr std::array<Command, 15> kCommands = {{
    {"bake", "LEVEL.gltf -o LEVEL.clamor", "traces sound through a level and writes a bake file",
     run_bake},
    {"merge", "SHARDS... -o LEVEL.clamor", "joins the parts of a bake that several machines traced",
     run_merge},
    {"farm", "LEVEL.gltf -o LEVEL.clamor", "plans a bake for many machines, and says how far it is",
     run_farm},
    {"inspect", "LEVEL.clamor", "prints what a bake file holds", run_inspect},
    {"report", "LEVEL.clamor -o PAGE.html",
     "writes what a bake sounds like as a page for a browser", run_report},
    {"diff", "A.clamor B.clamor", "prints how two bake files differ", run_diff},
    {"play", "LEVEL.clamor", "plays a bake; the keyboard walks through it", run_play},
    {"view", "LEVEL.glb or LEVEL.clamor", "a window to walk in, listen and edit", run_view},
    {"render", "LEVEL.clamor -o OUT.wav", "renders the same to a WAV or FLAC file", run_render},
    {"impulse", "LEVEL.clamor -o IR.wav", "impulse response and room parameters (ISO 3382-1)",
     run_impulse},
    {"compare", "A.wav B.wav", "audible differences between two recordings", run_compare},
    {"experiment", "NAME LEVEL.clamor -o DIR", "measures the paper's figures and claims again",
     run_experiment},
    {"materials", "", "lists the acoustic material presets", run_materials},
    {"devices", "", "lists the sound devices that play can use", run_devices},
    {"bench", "mixer", "measures how many voices this machine mixes", run_bench},
}};

std::string help(std::size_t columns) {
  constexpr std::size_t kNameColumns = 46;
  const auto entry = [columns](const std::string& name, std::string_view text) {
    return list_entry(name, std::string(text), kNameColumns, columns);
  };
  std::string text =
      wrapped("clamor: bakes the acoustics of a level and plays them back", columns) + "\n\n";
  for (const Command& command : kCommands)
    text += entry(fmt::format("clamor {}{}{}", command.name, command.operands.empty() ? "" : " ",
                              command.operands),
                  command.summary);
  return text + "\n" + entry("clamor COMMAND --help", "options of one command") +
         "  clamor --version\n\n" +
         example_lines(
             "clamor bake level.glb -o level.clamor --emitter \"signal=noise,at=0,1.5,0\" && "
             "clamor "
             "play level.clamor",
             columns);
}

constexpr std::array<Command, 3> kFarmCommands = {{
    {"status", "", "says how far a farm is", run_farm},
    {"resume", "", "prints, runs or submits what a farm lacks", run_farm},
    {"merge", "", "merges the shards of a farm", run_farm},
}};

// Asks each command for the options that it declares; those of the farm take their names.
std::vector<CommandDescription> descriptions() {
  std::vector<CommandDescription> all;
  const auto ask = [&all](const Command& command, std::span<const std::string> words) {
    DescriptionStream described;
    command.run(words, described, described);
    described.description.summary = command.summary;
    all.push_back(std::move(described.description));
  };
  for (const Command& command : kCommands) ask(command, {});
  for (const Command& command : kFarmCommands) {
    const std::string name(command.name);
    ask(command, std::span(&name, 1));
  }
  return all;
}

int run_command(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  if (arguments.empty()) {
    err << help(columns_of(err));
    return kBadUsage;
  }
  const std::string& name = arguments[0];
  if (name == "--help" || name == "-h" || name == "help") {
    out << help(columns_of(out));
    return kSuccess;
  }
  if (name == "--version") {
    out << "clamor " << kVersion << '\n';
    return kSuccess;
  }
  if (name == "manual") return run_manual(descriptions(), arguments.subspan(1), out, err);
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
  Interrupt::forget();
  int code = run_command(arguments, out, err);
  if (code == kBadInput && Interrupt::requested()) code = kInterrupted;
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
