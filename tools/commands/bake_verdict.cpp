#include "tools/commands/bake_verdict.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "tools/analysis/room_parameters.h"
#include "tools/commands/bake_difference.h"
#include "tools/report/bake_overview.h"

namespace clamor {

namespace {

// In standard errors. There are 16 differences, and the errors are themselves estimates.
constexpr double kByChance = 4;

// A difference of one parameter in one band.
struct Step {
  std::string words;             // "T30 by 3.1 % at 500 Hz"
  double noticeable = 0;         // in just-noticeable differences
  std::optional<double> errors;  // in standard errors of the difference; nothing: unknown
};

std::vector<Step> steps_of(const BakeFile& a, const BakeFile& b) {
  const DecaySummary &decay_a = a.statistics().decay, &decay_b = b.statistics().decay;
  const Bands none{};
  const auto louder_db = level_difference_db(a.top() != nullptr ? a.top()->power : none,
                                             b.top() != nullptr ? b.top()->power : none);
  const double error_db = std::hypot(decay_a.error_db, decay_b.error_db);
  std::vector<Step> steps;
  for (std::size_t band = 0; band < kBandCount; ++band) {
    const double level_db = std::abs(louder_db[band]);
    steps.push_back({fmt::format("the level by {:.2f} dB at {}", level_db, band_title(band)),
                     level_db / kind_of("G").noticeable_at(0),
                     error_db > 0 ? std::optional(level_db / error_db) : std::nullopt});
    const double t_a = decay_a.t30_s[band], t_b = decay_b.t30_s[band];
    if (!(t_a > 0 && t_b > 0)) continue;
    const double error_s = std::hypot(decay_a.t30_error_s[band], decay_b.t30_error_s[band]);
    steps.push_back(
        {fmt::format("T30 by {:.1f} % at {}", 100 * std::abs(t_b / t_a - 1), band_title(band)),
         std::abs(t_b - t_a) / kind_of("T30").noticeable_at(t_a),
         error_s > 0 ? std::optional(std::abs(t_b - t_a) / error_s) : std::nullopt});
  }
  return steps;
}

}  // namespace

BakeVerdict verdict_on(const BakeFile& a, const BakeFile& b) {
  if (!is_same_scene(a, b) || a.provenance().input_hash != b.provenance().input_hash)
    return {Audible::kYes, "They do not sound the same."};
  const std::vector<Step> steps = steps_of(a, b);
  const Step& most = *std::ranges::max_element(steps, {}, &Step::noticeable);
  if (most.noticeable < 1)
    return {Audible::kNo,
            fmt::format("They differ, but sound alike: at most {}; 1 dB and 5 % would be just "
                        "noticeable.",
                        most.words)};
  const Step* certain = nullptr;  // the most noticeable that chance does not explain
  for (const Step& step : steps)
    if (step.noticeable >= 1 && step.errors.value_or(kByChance) >= kByChance &&
        (certain == nullptr || step.noticeable > certain->noticeable))
      certain = &step;
  if (certain == nullptr)
    return {Audible::kMaybe,
            fmt::format("They may sound different: {}, {:.1f} times what is just noticeable, but "
                        "another seed may change as much. More photons would tell.",
                        most.words, most.noticeable)};
  return {Audible::kYes, fmt::format("They do not sound the same: {}, {:.1f} times what is just "
                                     "noticeable, and more than another seed changes.",
                                     certain->words, certain->noticeable)};
}

}  // namespace clamor
