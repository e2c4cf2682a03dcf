// first_reflections.h: the first reflections of moving sources, from surfaces that the sources
// themselves see.
//
// A probe two metres off has them wrong: it does not light the same surfaces. So each source traces
// its own (first_reflection_tracer.h). While it is near the place that they were traced from, they
// follow it in delay, power and mirror direction (probe_sources.h). A set of rays is traced anew
// when the source has moved by a quarter of the distance to its nearest surface, or the listener by
// half of the distance to its nearest reflection, and when a part has moved, but for that not more
// often than every 0.2 s. At most one set that a source has is traced anew in a keyframe, so most
// of its reflections stay as they are while some crossfade.
//
// Where mirrors reflect the sound of one of the 64 loudest sources, image sources take their
// place (source_mirrors.h), and the traced reflections keep what the mirrors scatter.
//
// A source has six sets. Where more than 170 sources sound at once, each has fewer, and one where
// more than 512 do: the sets that it has stand for all. A source that is new or has leaped traces
// at least one at once. All others share what that leaves of a budget of 1024 rays per keyframe,
// 0.4 ms of one core; the sources that are the loudest and have moved the farthest come first.
//
// Threads: the sampler's alone.   Memory: 50 kB per source that reverberates, more near
// a listener.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/probes/first_reflection_kernel.h"
#include "runtime/probes/first_reflection_tracer.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/probes/source_mirrors.h"

namespace clamor {

class FirstReflections {
 public:
  // All arguments must outlive the object. Images are heard only by those who test what is on
  // their paths, so others take none.
  FirstReflections(const OcclusionGeometry& surfaces, FirstReflectionTracer tracer,
                   const ProbeBounds& bounds, std::size_t sources, bool with_images);

  // Begins a keyframe.
  void begin(const Vec3& listener_m);
  // Adds a source to the keyframe. It is new if it has another `generation`. The loudness of its
  // loudest band is `factor`, in parts of the bounds' signal, and that of each band `band_shares`
  // of it.
  void add(std::size_t source, std::uint32_t generation, const Vec3& place_m, float factor,
           const Bands& band_shares);
  // Traces what the sources of the keyframe need.
  void trace();

  // Whether sets still wait without anything moving.
  bool is_settled() const { return is_settled_; }

  // A reflection, by the numbers of its source and set.
  struct Found {
    std::uint32_t source = 0, set = 0, index = 0;
    // The bound holds for the priority with the full late boost and all bands as loud as the
    // loudest.
    float upper_bound = 0;
  };
  // Replaces `found` by all reflections that may reach the threshold at the place. Returns how many
  // it has tested.
  std::size_t find_above(const Vec3& place, double threshold, std::vector<Found>& found);
  double upper_bound(const Vec3& place) const;

  const FirstReflection& stored(const Found& found) const {
    return states_[found.source]->sets[found.set].reflections[found.index];
  }
  // The reflection for the source's own place. Its emitter is 0.
  Source moved(const Found& found, const MovingRadiator& radiator) const;
  // Calls visit(source, mirror) for each mirror of the keyframe's sources that makes an image.
  template <class Visit>
  void for_each_image(const Visit& visit) const {
    for (const Active& active : active_) {
      const State& state = *states_[active.source];
      if (!state.has_images) continue;
      for (const SourceMirrors::Mirror& mirror : state.mirrors.all())
        if (mirror.makes_image) visit(active.source, mirror);
    }
  }
  // Identifies the reflection until it is traced again, below 2^61.
  std::uint64_t number(const Found& found) const;

 private:
  static constexpr std::size_t kSets = FirstReflectionTracer::kSets;

  struct Set {
    Vec3 place_m{}, listener_m{};                    // of source and listener when it was traced
    double valid_m = 0, valid_for_listener_m = 0;    // radii around both within which it holds
    std::uint64_t parts_version = 0, traced_in = 0;  // of the surfaces, and the keyframe
    std::uint32_t count = 0;                         // how often it was traced
    std::vector<FirstReflection> reflections;
    std::vector<std::uint32_t> mirrors;  // the index of each reflection's, or kNone
    FirstReflectionRows rows;
  };
  struct State {
    std::uint32_t generation = 0;
    Vec3 last_m{};           // the place in the last keyframe
    std::size_t traced = 0;  // sets, the first ones
    std::array<Set, kSets> sets;
    SourceMirrors mirrors;
    bool has_images = false;
  };
  struct Active {
    std::uint32_t source = 0;
    Vec3 place_m{};
    float factor = 0;
    Bands band_shares{};
    double loudness = 0;  // for the listener
  };
  // A set that waits to be traced.
  struct Waiting {
    std::uint32_t active = 0, set = 0;
    double urgency = 0;
  };

  void list_waiting(std::size_t active, std::size_t sets);
  void trace(const Active& active, std::size_t set);
  void find_mirrors(State& state, std::size_t set) const;
  void choose_images();
  double staleness(const Set& set, const Vec3& place_m) const;
  static float power_of_set(const State& state);

  const OcclusionGeometry& surfaces_;
  const FirstReflectionTracer tracer_;
  const ProbeBounds& bounds_;
  const bool with_images_;
  std::vector<std::unique_ptr<State>> states_;  // by source; null: it has not sounded yet
  std::vector<Active> active_;
  std::vector<Waiting> waiting_;
  std::vector<double> loudness_;  // scratch memory of choose_images()
  CulledPage reaching_;
  Vec3 listener_m_{};
  std::uint64_t keyframe_ = 0, parts_version_ = 0;
  std::int64_t rays_left_ = 0;
  bool is_settled_ = true;
};

}  // namespace clamor
