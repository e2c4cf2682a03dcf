// received_paths.h: energy that traced paths bring to receivers, for any absorption on their way.
//
// A path keeps its energy at a receiver and how often each material reflected it, so that decay
// times with other absorptions, and their derivatives, are sums over the same paths
// (absorption_fit.h has the formula).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/report/decay_estimate.h"
#include "common/bands.h"

namespace clamor {

struct BakeOptions;
struct KeptRun;
struct Material;
struct Mesh;
class TracedState;

// All materials of one name, which are alike, and whose absorption is fitted.
struct FittedMaterial {
  std::string name;
  double area_m2 = 0;
  Bands absorption{};  // of the level
};

struct FittedMaterials {
  static constexpr std::uint16_t kFixed = 0xffff;

  FittedMaterials(const Mesh& mesh, std::span<const Material> materials);

  std::vector<FittedMaterial> list;     // largest area first
  std::vector<std::uint16_t> of_level;  // by material, its index in the list, or kFixed
  double total_area_m2 = 0;
};

// What traced paths bring to the receivers of a decay estimate, and which materials they met.
class ReceivedPaths {
 public:
  // Traces a state of a level with these materials.
  ReceivedPaths(const TracedState& state, std::size_t receivers,
                std::span<const Material> materials, const FittedMaterials& fitted,
                const BakeOptions& options);

  // A decay time in one octave with other absorptions, and its derivatives.
  struct Decay {
    std::optional<double> time_s;  // mean over receivers, where most have one
    double error_s = 0;
    double effective = 0;        // paths that carry the end of the range, if they were alike
    std::vector<double> slopes;  // d ln time / d absorption, by fitted material
  };
  Decay decay(std::size_t band, std::span<const double> absorptions, double to_db) const;

 private:
  struct Path {
    ReceivedEnergy received;
    std::uint32_t group = 0;
  };
  struct RunPaths {
    std::vector<Path> paths;
    std::vector<std::uint16_t> met;  // by path and unknown: how often
  };
  using Steps = std::vector<double>;

  RunPaths receive(const KeptRun& run, const DecayEstimate& estimate, double photon_share,
                   const FittedMaterials& fitted) const;
  std::optional<double> time_s(std::span<const Steps> at_receivers, double to_db) const;

  std::vector<RunPaths> runs_;  // in the order of the plan
  std::vector<Bands> traced_;
  std::size_t receivers_ = 0, steps_ = 0;
};

}  // namespace clamor
