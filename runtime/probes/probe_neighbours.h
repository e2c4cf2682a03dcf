// probe_neighbours.h: the probes round each moving source, with weights that change smoothly.
//
// The weight of a probe at a distance d is v / (d^2 + e^2)^2, v the share of it that the source
// sees. The four largest count, less the fifth, so a probe enters and leaves with weight zero; they
// are scaled to a sum of one. Lines of sight are tested when a source has moved by a tenth of the
// distance to its nearest probe, and v follows a test over some keyframes, so a source that drives
// through a door crossfades from one room's probes to the other's.
//
// A source that sees no probe, as inside a solid, has none.
//
// Threads: the sampler's alone.   Memory: 130 bytes per source.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor {

class OcclusionGeometry;

inline constexpr std::size_t kMaxCopies = 4;  // probes that one source is heard through

struct ProbeWeight {
  std::uint32_t probe = 0;
  float weight = 0;  // of power
};

class ProbeNeighbours {
 public:
  // `surfaces` may be null: nothing hides a probe. It must outlive the object.
  ProbeNeighbours(std::vector<Vec3> probes_m, const OcclusionGeometry* surfaces,
                  std::size_t sources);
  ~ProbeNeighbours();

  // Begins a keyframe.
  void begin();

  // The weights of a source's probes at its place, at most kMaxCopies, the largest first. A source
  // with another `generation` is new. Valid until the next call.
  std::span<const ProbeWeight> weights(std::size_t source, std::uint32_t generation,
                                       const Vec3& place_m);

  // Whether weights still change without anything moving.
  bool is_settled() const { return is_settled_; }
  // Sources of the keyframe that saw no probe.
  std::size_t unseen() const { return unseen_; }

 private:
  static constexpr std::size_t kCandidates = 8;
  struct Tree;
  struct State {
    std::array<std::uint32_t, kCandidates> probe{};
    std::array<float, kCandidates> seen{}, seen_now{};  // smoothed, and at the last test
    std::uint32_t count = 0, generation = 0;
    Vec3f tested_m{};
    float valid_m = -1;  // from tested_m
    bool is_new = true;
  };

  void find_candidates(State& state, const Vec3& place_m);
  void test(State& state, const Vec3& place_m);

  std::vector<Vec3> probes_m_;
  const OcclusionGeometry* surfaces_;
  std::unique_ptr<Tree> tree_;
  std::vector<State> states_;  // by source
  std::array<ProbeWeight, kMaxCopies + 1> weights_{};
  std::int64_t rays_left_ = 0;
  bool is_settled_ = true;
  std::size_t unseen_ = 0;
};

}  // namespace clamor
