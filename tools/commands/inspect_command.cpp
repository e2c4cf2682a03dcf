// inspect_command.cpp: clamor inspect: prints what a bake file holds, or what a bake would take a
// level for.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "formats/bake_file/bake_file.h"
#include "tools/analysis/json_values.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/commands.h"
#include "tools/commands/inspect_tables.h"
#include "tools/commands/level_inspection.h"
#include "tools/program/arguments.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/report/bake_json.h"

namespace clamor {

int run_inspect(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string path;
  bool json = false, pages = false, whole = false;
  ImportOptions import;
  Arguments parser("inspect",
                   "Prints what a bake file holds and how it was made; or, without baking, what is "
                   "found in a level, what each rule leaves out and what to check.",
                   "clamor inspect hall.clamor --pages | sort -k4 -n | tail -5");
  parser.positional("file", path, "the bake file, or a level, a .gltf or .glb file");
  parser.flag("--json", json,
              "print everything as JSON; formats/bake_format.md documents the keys");
  parser.flag(
      "--pages", pages,
      "also print one line per page: tree, depth, offset, bytes, sources, children, instances; "
      "then the pages of the geometry");
  parser.flag("--verify", whole,
              "decode every page, signal and triangle, and name the first damaged one");
  add_import_options(parser, import);
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  const auto fail = [&err](const Error& error) {
    print_error(err, "inspect", error.message);
    return kBadInput;
  };
  if (is_level_file(path)) {
    const auto printed = inspect_level(path, import, json, out);
    return printed.ok() ? kSuccess : fail(printed.error());
  }
  const auto file = BakeFile::open(path, FileAccess::kMap);
  if (!file.ok()) return fail(file.error());
  if (whole) {
    StageNotice notice(quiet.notes(err));
    notice.begin("decoding every page, signal and triangle");
    if (const auto good = verify(*file); !good.ok()) return fail(good.error());
  }
  const auto overview = overview_of(*file);
  if (!overview.ok()) return fail(overview.error());
  const auto bake = bake_json(*file, *overview, pages);
  if (!bake.ok()) return fail(bake.error());
  if (json) {
    out << json_text(*bake) << '\n';
    return kSuccess;
  }
  print_tables(*file, *overview, *bake, out);
  if (whole) fmt::print(out, "\nverified: every page, signal and triangle is intact\n");
  return kSuccess;
}

}  // namespace clamor
