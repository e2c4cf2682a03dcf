#include "tools/commands/place_warnings.h"

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "bake/report/audibility.h"
#include "bake/report/audibility_messages.h"
#include "bake/trace/scene.h"
#include "formats/bake_file/bake_metadata.h"
#include "runtime/sampling/moving_script.h"
#include "tools/program/terminal_output.h"

namespace clamor {

namespace {

std::vector<double> tested_times_s(double from_s, double until_s) {
  constexpr std::size_t kSteps = 32;
  std::vector<double> times_s = {from_s};
  for (std::size_t i = 1; until_s > from_s && i <= kSteps; ++i)
    times_s.push_back(from_s + (until_s - from_s) * static_cast<double>(i) / kSteps);
  return times_s;
}

std::optional<std::string> reverberation_warning(const BakeFile& file,
                                                 const MovingOptions& moving) {
  if (moving.max_sources == 0 || !moving.reverberates || !file.probes().places.empty())
    return std::nullopt;
  return "the bake has no probes, so moving sources are heard without reflections; bake with "
         "--probes auto, or give them \"reverberation_db\": -200 in the script";
}

}  // namespace

PlaceCheck::PlaceCheck(const BakeFile& file, bool with_occlusion) : file_(file) {
  if (!with_occlusion) return;
  auto read = file.read_mesh();
  is_readable_ = read.ok();
  if (!is_readable_) return;
  mesh_ = std::move(*read);
  extent_ = LevelExtent(file, mesh_);
}

PlaceCheck::~PlaceCheck() = default;

std::optional<std::string> PlaceCheck::listener_warning(const Walk& walk, const Query& query) {
  if (!is_readable_) return std::nullopt;
  const auto times_s = tested_times_s(0, std::min(query.seconds, walk.length_s()));
  std::vector<Vec3> places_m;
  for (const double time_s : times_s)
    places_m.push_back(walk.at(time_s).position_m - file_.origin_m());
  if (!query.with_moving_sources) {
    if (audibility_ == nullptr) {
      scene_ = std::make_unique<Scene>(mesh_, Scene::Build::kQuick);
      audibility_ = std::make_unique<Audibility>(*scene_, mesh_, file_.materials());
    }
    std::span<const Emitter> emitters = file_.emitters();
    if (query.emitter) emitters = emitters.subspan(*query.emitter, 1);
    const auto answers = audibility_->inaudible_at(places_m, emitters, file_.settings().air);
    const auto silent = [](const std::optional<InaudiblePlace>& answer) {
      return answer.has_value();
    };
    const auto first = std::find_if(answers.begin(), answers.end(), silent);
    if (first != answers.end()) {
      const auto index = static_cast<std::size_t>(first - answers.begin());
      std::string text = in_words(**first, places_m[index], emitters, file_.origin_m());
      if (times_s.size() > 1)
        text += fmt::format(
            " ({:.1f} s into the walk; of {} positions tested along it, hardly anything is heard "
            "at {})",
            times_s[index], answers.size(), std::count_if(answers.begin(), answers.end(), silent));
      return text;
    }
  }
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    auto complaint = extent_.complaint("the listener", places_m[i] + file_.origin_m());
    if (!complaint) continue;
    if (times_s.size() > 1) *complaint += fmt::format(" ({:.1f} s into the walk)", times_s[i]);
    return complaint;
  }
  return std::nullopt;
}

std::optional<std::string> PlaceCheck::source_warning(const MovingScript& script,
                                                      double seconds) const {
  std::optional<std::string> warning;
  const double end_s = seconds > 0 ? seconds : std::numeric_limits<double>::infinity();
  script.for_each_path([&](const std::string& name, const Walk& path, double from_s,
                           double until_s) {
    if (warning || from_s >= end_s) return;
    const std::string thing = name.empty() ? "a moving source" : "moving source " + in_quotes(name);
    for (const double time_s :
         tested_times_s(from_s, std::min({until_s, end_s, std::max(from_s, path.length_s())}))) {
      warning = extent_.complaint(thing, path.at(time_s).position_m);
      if (!warning) continue;
      *warning += fmt::format(" ({:.1f} s into the script)", time_s);
      return;
    }
  });
  return warning;
}

void print_place_warnings(const BakeFile& file, const Walk& walk, double seconds,
                          const AuralizerOptions& options, std::ostream& err) {
  PlaceCheck places(file, options.visibility);
  if (const auto warning = places.listener_warning(
          walk, {.seconds = seconds, .with_moving_sources = options.script != nullptr}))
    print_warning(err, *warning);
  if (options.script != nullptr)
    if (const auto warning = places.source_warning(*options.script, seconds))
      print_warning(err, *warning);
  if (const auto warning = reverberation_warning(file, options.moving))
    print_warning(err, *warning);
}

}  // namespace clamor
