// probe_thinning.h: keeps probes that no other probe replaces.
//
// Dart throwing (Poisson disk) in the order in which candidates are offered. A kept probe replaces
// a candidate if it sees it, is nearer than the candidate's spacing, and has much the same view: a
// change of view makes the distance count up to four times.
//
// Threads: one.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <vector>

#include "bake/probes/probe_view.h"
#include "bake/trace/scene.h"
#include "common/vec.h"

namespace clamor {

struct ProbeCandidate {
  Vec3 place_m{};
  ProbeView view;
  bool is_roof = false, is_in_air = false;
};

// kDistance ignores views, for levels so full of corners that comparing them keeps too many.
enum class ProbeThinningBy { kViews, kDistance };

class ProbeThinning {
 public:
  // `hand_placed_m` keep half of `spacing_m` free around them. No candidate's spacing may exceed
  // `greatest_m`. Both lists must outlive the object.
  ProbeThinning(const Scene& scene, const std::vector<Vec3>& hand_placed_m, double spacing_m,
                ProbeThinningBy by);

  // Keeps the candidate, which must outlive the object, unless a kept one replaces it.
  bool offer(const ProbeCandidate& candidate, double spacing_m);

  // Returns whether a kept probe within the distance sees the candidate and much of its view.
  bool has_companion(const ProbeCandidate& candidate, double within_m) const;

  const std::vector<const ProbeCandidate*>& kept() const { return kept_; }

 private:
  using Bucket = std::array<long long, 3>;

  Bucket bucket_of(const Vec3& place_m) const;
  bool is_replaced_by(const ProbeCandidate& kept, const ProbeCandidate& candidate,
                      double spacing_m) const;
  std::vector<const ProbeCandidate*> near(const Vec3& place_m, double within_m) const;

  const Scene& scene_;
  const std::vector<Vec3>& hand_placed_m_;
  double spacing_m_, bucket_m_;
  ProbeThinningBy by_;
  std::vector<const ProbeCandidate*> kept_;
  std::map<Bucket, std::vector<const ProbeCandidate*>> buckets_;
};

}  // namespace clamor
