#include "tools/commands/audibility_warnings.h"

#include <algorithm>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "bake/report/audibility_messages.h"
#include "bake/trace/scene.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

std::optional<std::string> reverberation_warning(const BakeFile& file,
                                                 const MovingOptions& moving) {
  if (moving.max_sources == 0 || !moving.reverberates || !file.probes().places.empty())
    return std::nullopt;
  return "the bake has no probes, so moving sources are heard without reflections; bake with "
         "--probes auto, or give them \"reverberation_db\": -200 in the script";
}

std::optional<std::string> audibility_warning(const BakeFile& file, const Walk& walk,
                                              const AudibilityQuery& question) {
  Mesh mesh;
  if (question.with_occlusion) {
    auto read = file.read_mesh();
    if (!read.ok()) return std::nullopt;
    mesh = std::move(*read);
  }
  std::span<const Emitter> emitters = file.emitters();
  if (question.emitter) emitters = emitters.subspan(*question.emitter, 1);

  constexpr std::size_t kSteps = 32;
  const double end_s = std::min(question.seconds, walk.length_s());
  std::vector<double> times_s = {0};
  for (std::size_t i = 1; end_s > 0 && i <= kSteps; ++i)
    times_s.push_back(end_s * static_cast<double>(i) / kSteps);
  std::vector<Vec3> places_m;
  for (const double time_s : times_s)
    places_m.push_back(walk.at(time_s).position_m - file.origin_m());

  const Scene scene(mesh, Scene::Build::kQuick);
  const auto answers = Audibility(scene, mesh, file.materials())
                           .inaudible_at(places_m, emitters, file.settings().air);
  const auto silent = [](const std::optional<InaudiblePlace>& answer) {
    return answer.has_value();
  };
  const auto first = std::find_if(answers.begin(), answers.end(), silent);
  if (first == answers.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(first - answers.begin());
  std::string text = in_words(**first, places_m[index], emitters, file.origin_m());
  if (times_s.size() > 1)
    text += fmt::format(
        " ({:.1f} s into the walk; of {} positions tested along it, hardly anything is heard at "
        "{})",
        times_s[index], answers.size(), std::count_if(answers.begin(), answers.end(), silent));
  return text;
}

}  // namespace clamor
