// probe_neighbours.h: the probes round each moving source, with weights that change smoothly.
//
// The weight of a probe that the source sees, at a distance d, is 1 / (d^2 + e^2)^2. The four
// largest count, less the fifth, so a probe enters and leaves with weight zero; they are scaled to
// a sum of one. Lines of sight are tested when a source has moved by a tenth of the distance to its
// nearest probe, and when a movable part has moved, but for that not more often than every 0.2 s.
//
// In each keyframe a source's weights take 15 % of the way there, as rooms do not forget a source
// at once either, so a source that drives or flies is heard through up to eight probes and the
// level of its reflections does not step. It lags behind by some 100 ms. One that drives through a
// door crossfades from one room's probes to the other's. One that leaps does not.
//
// A source that sees no probe, as inside a solid, keeps its weights for 0.4 s, and then has none.
//
// Threads: the sampler's alone.   Memory: 170 bytes per source.
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

inline constexpr std::size_t kMaxCopies = 8;  // probes that one source is heard through
// A source that moves by more than this in a keyframe leaps: nothing drives so fast.
inline constexpr double kLeap_m = 3;
// Parts that move cost rays at most every so many keyframes.
inline constexpr std::uint64_t kPartsTestedEvery = 10;

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
  static constexpr std::size_t kCandidates = 8, kNearest = 4;
  struct Tree;
  struct Weights {
    std::array<ProbeWeight, kMaxCopies> of{};  // the first `count` are in use
    std::uint32_t count = 0;

    std::span<const ProbeWeight> all() const { return std::span(of).first(count); }
    void scale_to_one();  // their sum; none if that is zero
  };
  struct State {
    std::array<std::uint32_t, kCandidates> probe{};
    std::array<bool, kCandidates> is_seen{};  // at the last test
    std::uint32_t count = 0, generation = 0;
    Vec3f last_m{}, tested_m{};
    float valid_m = -1;  // from tested_m
    bool is_new = true;
    std::uint8_t blind_keyframes = 0;  // without a probe that is seen
    std::uint64_t parts_version = 0;   // of the surfaces at the last test,
    std::uint64_t tested_in = 0;       // which was in this keyframe
    Weights now;
  };

  void test(State& state, const Vec3& place_m);
  void renew(State& state, const Vec3& place_m);
  Weights wanted(const State& state, const Vec3& place_m) const;
  static bool follow(Weights& now, const Weights& wanted);

  std::vector<Vec3> probes_m_;
  const OcclusionGeometry* surfaces_;
  std::unique_ptr<Tree> tree_;
  std::vector<State> states_;  // by source
  std::int64_t rays_left_ = 0;
  std::uint64_t keyframe_ = 0, parts_version_ = 0;
  bool is_settled_ = true;
  std::size_t unseen_ = 0;
};

}  // namespace clamor
