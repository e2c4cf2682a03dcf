// auralizer_input.h: what the runtime needs to know of a bake, decoded.
#pragma once

#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/signal.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/sampling/moving_sources.h"

namespace clamor {

struct AuralizerInput {
  std::vector<Source> sources;  // emitters and secondary sources, in any order
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  std::vector<Material> materials;
  Air air;
  std::vector<TimedEnvelope> envelopes{};  // of the signals; if none, they are listened to
  Mesh mesh{};                             // what stands in the way; empty in a free field
  DecaySummary decay{};                    // late sources are chosen by it (late_boost.h)
  // How the loops of moving sources begin (keyframe_maker.h): what the mixer plays beside the
  // signals, and for which of them.
  std::vector<Signal> onsets{};
  std::vector<std::uint32_t> loop_of_onset{};
};

// Decodes envelopes, no signals, no pages and no geometry: there are no sources yet, and nothing
// hides them.
Result<AuralizerInput> read_tables(const BakeFile& file);

// And all signals.
Result<AuralizerInput> read_signals_and_tables(const BakeFile& file);

// Decodes all pages and signals. Memory grows with the file.
Result<AuralizerInput> read_auralizer_input(const BakeFile& file);

// Decodes the geometry, which is for those who look through it.
Result<void> read_occluders(const BakeFile& file, AuralizerInput& input);

// An Error where an index points nowhere or there is nothing to hear.
Result<void> check(const AuralizerInput& input);

// Adds what moving sources may be: an emitter for each kind, their signals, and how loops begin,
// which is read from `file` where that has the signal and the input does not. Errors: a kind whose
// signal does not exist or cannot be read.
Result<void> add_kinds(const MovingOptions& moving, AuralizerInput& input,
                       const BakeFile* file = nullptr);

// By signal, what its beginning is played from. Onsets come after all signals.
OnsetSignals onset_signals(const AuralizerInput& input);

}  // namespace clamor
