// weighted_room.h: a small baked room with a different weight for each band.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/sampler.h"
#include "tests/baked_room.h"

namespace clamor::testing {

struct WeightedRoom {
  explicit WeightedRoom(std::uint64_t photons, const LateBoost& late_boost = {})
      : input(baked_room(photons)),
        radiation(input.emitters, input.materials, input.air, late_boost) {
    weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
  }
  const std::vector<Source>& sources() const { return input.sources; }
  SourceList list() const { return {radiation, weights, input.sources}; }
  double weight_of(std::size_t source, const Vec3& place,
                   const Reception& reception = Reception()) const {
    return weight(radiation, weights.by_signal[radiation.signal(sources()[source])],
                  sources()[source], place, reception);
  }

  AuralizerInput input;
  RadiationModel radiation;
  SignalWeights weights;
};

}  // namespace clamor::testing
