// room_comparison.h: a room as it was measured and as it is baked, octave by octave.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/analysis/report_page.h"
#include "tools/analysis/room_parameters.h"
#include "tools/experiments/experiments.h"

namespace clamor {

// What was measured, or what another program found, in the mean of these pairs.
struct RoomFigures {
  std::string by;                  // the program, or empty
  std::vector<std::size_t> pairs;  // source x number of receivers + receiver
  RoomParameters values;
};

// The parameters at each pair.
using AtPairs = std::vector<RoomParameters>;

// Compares octave by octave. All arguments must outlive it.
class RoomComparison {
 public:
  // `names` are those of the pairs.
  RoomComparison(std::span<const RoomFigures> figures, std::span<const std::string> names,
                 std::span<const AtPairs> by_seed);

  // Adds a chart, and rows to the table of means; to the summary, the mean size of the differences
  // from 250 Hz to 4 kHz.
  void add(const ParameterKind& kind, ReportTable& means, std::vector<Chart>& charts,
           std::string& summary) const;

  // Adds rows for one pair: means over the seeds, their deviation, and what was measured there.
  void add_pair(std::size_t pair, const ParameterKind& kind, ReportTable& table) const;

 private:
  using Value = RoomParameters::Value;
  std::vector<double> values_by(const std::string& by, const ParameterKind& kind,
                                std::size_t b) const;

  Value mean_by(const std::string& by, const ParameterKind& kind) const;

  // The pairs for which there is such a value.
  std::vector<std::size_t> pairs_of(const std::string& by, const ParameterKind& kind,
                                    std::size_t b) const;

  // The spread, over the seeds, of the mean over those of the pairs that have the parameter.
  std::optional<Spread> over_seeds(const std::vector<std::size_t>& pairs, const ParameterKind& kind,
                                   std::size_t b) const;

  const std::span<const RoomFigures> figures_;
  const std::span<const std::string> pair_names_;
  const std::span<const AtPairs> by_seed_;
  std::vector<std::string> names_;  // of those who give figures
  std::vector<std::size_t> all_pairs_;
};

}  // namespace clamor
