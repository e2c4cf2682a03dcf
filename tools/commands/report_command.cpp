// report_command.cpp: clamor report: what a bake sounds like, as one page.
#include <ostream>
#include <vector>

#include <fmt/format.h>

#include "embedded_page.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/files/atomic_file.h"
#include "formats/files/output_target.h"
#include "formats/level/walk_file.h"
#include "tools/analysis/json_values.h"
#include "tools/analysis/report_page.h"
#include "tools/commands/commands.h"
#include "tools/commands/place_warnings.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/output_ending.h"
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"
#include "tools/report/listening_scripts.h"
#include "tools/report/report_document.h"

namespace clamor {

namespace {

constexpr std::size_t kListenerSources = 8'000, kMapSources = 4000, kMapCells = 240;
constexpr std::size_t kMaxListeners = 9;  // colours of a chart

struct ReportOptions {
  std::string level, output, other, emitter, player;
  std::vector<Vec3> listeners_m;
  bool exact = false;
};

struct OpenRoom {
  explicit OpenRoom(BakeFile opened) : file(std::move(opened)) {}
  BakeFile file;
  Room room;
};

Result<std::unique_ptr<OpenRoom>> open_room(const std::string& path) {
  auto file = BakeFile::open(path, FileAccess::kMap);
  if (!file.ok()) return file.error();
  auto opened = std::make_unique<OpenRoom>(std::move(*file));
  auto room = Room::read(opened->file);
  if (!room.ok()) return room.error();
  opened->room = std::move(*room);
  return opened;
}

MeasuredRoom measure_at(const ReportOptions& options, const RoomMeter& meter,
                        const std::vector<Vec3>& listeners_m, const std::string& label,
                        StageNotice& notice, std::ostream& err) {
  MeasuredRoom measured{&meter, {}};
  Progress progress(err, label);
  notice.begin("measuring at listeners");
  for (const Vec3& listener_m : listeners_m) {
    measured.responses.push_back(
        meter.measure(listener_m, options.exact ? RoomMeter::kAll : kListenerSources));
    const auto held = notice.hold();
    progress.update(
        static_cast<double>(measured.responses.size()) / static_cast<double>(listeners_m.size()),
        {counted(measured.responses.back().sources, "source")});
  }
  return measured;
}

// Warns of listeners who hear nothing of a bake or are outside its level.
void warn_of_places(const BakeFile& file, const std::string& path,
                    const std::vector<Vec3>& listeners_m, std::ostream& err) {
  PlaceCheck check(file, true);
  for (const Vec3& listener_m : listeners_m)
    if (const auto warning = check.listener_warning(Walk::standing({listener_m}), {}))
      print_warning(err, path + ": " + *warning);
}

Result<OrderedJson> document_of(const ReportOptions& options, std::ostream& notes,
                                std::ostream& err) {
  StageNotice notice(notes);
  notice.begin("reading the bake");
  auto opened = open_room(options.level);
  if (!opened.ok()) return opened.error();
  const Room& room = (*opened)->room;
  auto excitation = excitation_of(room, options.emitter);
  if (!excitation.ok()) return excitation.error();
  std::unique_ptr<OpenRoom> other;
  std::optional<RoomMeter> other_meter;
  if (!options.other.empty()) {
    notice.begin("reading the other bake");
    auto second = open_room(options.other);
    if (!second.ok()) return second.error();
    other = std::move(*second);
    auto other_excitation = excitation_of(other->room, options.emitter);
    if (!other_excitation.ok()) return other_excitation.error();
    other_meter.emplace(other->room, *other_excitation);
  }
  ReportContents contents;
  notice.begin("finding the floor");
  contents.map = floor_grid(room, kMapCells);
  // The map is relative to the level's origin, all else is in the world.
  const Vec3& origin_m = room.file->origin_m();
  std::vector<Vec3> listeners_m = options.listeners_m;
  if (listeners_m.empty())
    for (const Vec3& place_m : listening_places(room, *excitation, contents.map))
      listeners_m.push_back(place_m + origin_m);
  warn_of_places((*opened)->file, options.level, options.listeners_m, err);
  if (other != nullptr) warn_of_places(other->file, options.other, listeners_m, err);
  const RoomMeter meter(room, *excitation);
  contents.measured = measure_at(options, meter, listeners_m, "  listeners", notice, notes);
  if (!contents.map.cells.empty()) {
    Progress progress(notes, "  map");
    notice.begin("measuring over the floor");
    measure(
        meter, kMapSources,
        [&](double share) {
          const auto held = notice.hold();
          progress.update(share, {counted(contents.map.cells.size(), "place")});
        },
        contents.map);
    contents.map_at_first = meter.quick(listeners_m[0] - origin_m, kMapSources);
  }
  if (other_meter)
    contents.other =
        measure_at(options, *other_meter, listeners_m, "  the other bake", notice, notes);
  notice.begin("writing the page");
  return report_document(contents);
}

}  // namespace

int run_report(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  ReportOptions options;
  std::vector<std::string> listeners;
  Arguments parser(
      "report",
      "Writes what a bake sounds like, and whether anything is wrong with it, as one page for a "
      "browser: a view of the level with its sources, openings, gaps and a listener to drag; decay "
      "curves and room parameters (ISO 3382-1) at listeners; maps of level, C80 and T30 over the "
      "floor; materials and sizes. The page is one file and needs no network.",
      "clamor report hall.clamor -o report.html");
  parser.positional("bake", options.level, "the bake file");
  parser.option("-o,--output", options.output, "the page to write, HTML");
  parser.required("-o");
  parser.option("--listener", listeners,
                "position X,Y,Z in metres; may be repeated [unset: near, amid and far]");
  parser.option("--from", options.emitter,
                "name of the emitter that sounds [unset: the first, or all of a crowd]");
  parser.option("--compare", options.other,
                "another bake, to be shown beside it at the same places");
  parser.option("--listen", options.player,
                "the page sounds, by the player in this folder, which it then holds with the bake: "
                "the package @clamor/player, as tools/bundle --wasm builds it");
  parser.flag("--exact", options.exact,
              "measure at listeners with all sources, as clamor impulse does (slower)");
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  for (const std::string& text : listeners) {
    const auto pose = parse_listener(text);
    if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
    options.listeners_m.push_back(pose->position_m);
  }
  if (options.listeners_m.size() > kMaxListeners)
    return parser.bad_usage(err,
                            fmt::format("--listener may be given {} times at most", kMaxListeners));
  const auto fail = [&err](const Error& error) {
    print_error(err, "report", error.message);
    return kBadInput;
  };
  InputFiles inputs;
  inputs.add(options.level);
  inputs.add(options.other);
  if (const auto target = OutputTarget::find(options.output, inputs); !target.ok())
    return fail(target.error());
  if (const auto right = check_ending(options.output, ".html", "report pages"); !right.ok())
    return fail(right.error());
  std::ostream& notes = quiet.notes(err);
  const Progress whole(notes, "");
  const auto scripts = options.player.empty()
                           ? Result<std::string>(std::string())
                           : listening_scripts(options.player, options.level, options.other);
  if (!scripts.ok()) return fail(scripts.error());
  const auto document = [&] {
    const ExitOnSignal stop("report");
    return document_of(options, notes, err);
  }();
  if (!document.ok()) return fail(document.error());
  std::string page = page_of_document(*document, std::string(kViewScript) + kReportScript);
  page.insert(page.rfind("</body>"), *scripts);
  const Interrupt until_written;
  auto file = AtomicFile::create(options.output);
  if (!file.ok()) return fail(file.error());
  if (const auto written = file->write(std::as_bytes(std::span(page))); !written.ok())
    return fail(written.error());
  if (const auto done = file->commit(); !done.ok()) return fail(done.error());
  notes << fmt::format("  wrote    {}: {:.1f} MB in {}\n", options.output,
                       static_cast<double>(page.size()) / 1e6, format_duration(whole.seconds()));
  return kSuccess;
}

}  // namespace clamor
