#include "bake/bake_until.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <utility>

#include "bake/bake_plan.h"
#include "bake/trace/scene.h"
#include "common/text.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr double kFirstSourcesPerRoom = 20'000;
constexpr std::uint64_t kMostSources = 10'000'000;
// Maximum growth per round, because early error estimates are rough.
constexpr double kMaxGrowth = 32;
// Safety factor on the extrapolated error; one in ten bakes needs another round.
constexpr double kMargin = 1.1;
constexpr double kOfTime = 0.8;    // share of the remaining time to plan for
constexpr double kWorthIt = 1.25;  // minimum growth that justifies another round

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Rounds up to two digits, for a short command line.
std::uint64_t two_digits_up(double value) {
  double step = 1;
  while (value / step >= 100) step *= 10;
  return static_cast<std::uint64_t>(std::ceil(value / step) * step);
}

// Scales the next round by `growth`, as far as a file allows; false if it holds no more.
bool grow(BakeRounds& rounds, double growth, std::string& reason) {
  const std::uint64_t most = kMostSources / rounds.first_sources;
  if (rounds.times == most) {
    reason = "--until keeps " + std::to_string(kMostSources) + " sources at most";
    return false;
  }
  rounds.times = std::min(most, two_digits_up(growth * static_cast<double>(rounds.times)));
  ++rounds.round;
  return true;
}

}  // namespace

std::uint64_t BakeRounds::sources_of_first(const Level& level) {
  return static_cast<std::uint64_t>(kFirstSourcesPerRoom *
                                    emitter_rooms(Scene(level.mesh, Scene::Build::kQuick), level));
}

bool BakeRounds::go_on(double error_db, double goal_db, std::string& reason) {
  if (!(error_db > 0)) {
    reason = "the level is too open or too dry to tell the error of a decay";
    return false;
  }
  if (error_db <= goal_db) return false;
  if (round >= kMost) {
    reason = "the error falls too slowly";
    return false;
  }
  const double above = error_db / goal_db;
  return grow(*this, std::clamp(kMargin * above * above, kWorthIt, kMaxGrowth), reason);
}

std::optional<BakeGoal> BakeGoal::from(const std::string& text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, wrong] = std::from_chars(text.data(), end, number);
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  if (wrong != std::errc() || !(number > 0) || !(number < 1e6)) return std::nullopt;
  BakeGoal goal;
  if (equal_ignoring_case(unit, "dB"))
    goal.error_db = number;
  else if (equal_ignoring_case(unit, "s"))
    goal.seconds = number;
  else if (equal_ignoring_case(unit, "min"))
    goal.seconds = 60 * number;
  else if (equal_ignoring_case(unit, "h"))
    goal.seconds = 3600 * number;
  else
    return std::nullopt;
  return goal;
}

Result<BakeContents> bake_until(const Level& level, const BakeOptions& options,
                                const BakeGoal& goal, BakeReport* report, std::string* why_not) {
  const auto start = std::chrono::steady_clock::now();
  std::string ignored;
  std::string& reason = why_not != nullptr ? *why_not : ignored;
  BakeReport last, round;
  BakeOptions now = options;
  now.settings.photons = 0;
  now.settings.sources = BakeRounds::sources_of_first(level);
  double begun_s = seconds_since(start);
  auto best = bake(level, now, &last);
  if (!best.ok()) {
    if (report != nullptr) *report = last;
    return best;
  }
  BakeRounds rounds;
  rounds.first_photons = best->settings.photons;
  rounds.first_sources = best->settings.sources;
  while (rounds.round < BakeRounds::kMost) {
    if (best->statistics.photons_traced == 0) break;  // a free field has no error
    const double spent_s = seconds_since(start);
    if (goal.error_db > 0) {
      const auto error_db = static_cast<double>(best->statistics.decay.error_db);
      if (!rounds.go_on(error_db, goal.error_db, reason)) break;
    } else {
      const double growth = std::min(
          kOfTime * (goal.seconds - spent_s) / std::max(spent_s - begun_s, 0.01), kMaxGrowth);
      if (growth < kWorthIt || !grow(rounds, growth, reason)) break;
    }
    now.settings.sources = rounds.times * rounds.first_sources;
    now.settings.photons = rounds.times * rounds.first_photons;
    begun_s = spent_s;
    round = {};
    auto next = bake(level, now, &round);
    if (!next.ok()) {
      if (options.stop != nullptr && *options.stop) return next.error();
      reason = next.error().message;
      break;
    }
    best = std::move(next);
    last = round;
  }
  if (goal.error_db > 0 && reason.empty() &&
      static_cast<double>(best->statistics.decay.error_db) > goal.error_db)
    reason = "the error falls too slowly";
  if (report != nullptr) *report = last;
  return best;
}

}  // namespace clamor
