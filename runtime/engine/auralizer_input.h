// auralizer_input.h: the decoded data of a bake that the runtime needs.
#pragma once

#include <memory>
#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"
#include "formats/level/signal.h"
#include "runtime/mixing/onset_signals.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/sampling/moving_sources.h"

namespace clamor {

class BakeFile;
class LevelSurfaces;

struct AuralizerInput {
  std::vector<Source> sources;    // emitters and secondary sources, in any order
  std::vector<Emitter> emitters;  // that sources refer to, virtual ones of `portals` included
  std::vector<Signal> signals;
  std::vector<Material> materials;
  Air air;
  std::vector<TimedEnvelope> envelopes{};  // of the signals; computed from them if empty
  Mesh mesh{};                             // occluders; empty in a free field
  DecaySummary decay{};                    // decides the boost of late sources (late_boost.h)
  // Beginnings of loops that moving sources play (keyframe_maker.h): extra signals, and their
  // loops.
  std::vector<Signal> onsets{};
  std::vector<std::uint32_t> loop_of_onset{};
  std::vector<MovablePart> movable_parts{};  // which occlude besides the mesh
  // The virtual emitters of these begin at this index of `emitters`.
  BakedPortals portals{};
  std::size_t first_portal_emitter = 0;
  // Image sources, if the other sources are read in pages; a list of sources contains them.
  std::vector<Source> images{};
  // All listeners to a file share its surfaces. Without a file, a listener makes them from `mesh`.
  std::shared_ptr<LevelSurfaces> surfaces{};
  Vec3 origin_m{};  // of the level (formats/level/level_origin.h), which all of this is relative to
};

// Reads tables and envelopes, but no signals, no pages and no geometry: there are no sources yet,
// and nothing occludes.
Result<AuralizerInput> read_tables(const BakeFile& file);

// Reads all signals as well.
Result<AuralizerInput> read_signals_and_tables(const BakeFile& file);

// Reads all pages and signals. Memory grows with the file.
Result<AuralizerInput> read_auralizer_input(const BakeFile& file);

// Reads the movable parts and, unless another input of the file has them, the surfaces, which are
// needed for occlusion only.
Result<void> read_occluders(const BakeFile& file, AuralizerInput& input);

// The occluders, wherever they are.
const Mesh& mesh_of(const AuralizerInput& input);

// An error if an index is out of range.
Result<void> check(const AuralizerInput& input);

// Adds an emitter for each kind of moving source, their signals, and the beginnings of loops, which
// are read from `file` if the input lacks the signal. Errors: a kind whose signal does not exist or
// cannot be read.
Result<void> add_kinds(const MovingOptions& moving, AuralizerInput& input,
                       const BakeFile* file = nullptr);

// The first kOnset_frames of a loop, which plays `once` again and again.
Signal onset_of(std::span<const float> once);

// By signal: the signal that plays its beginning. Onsets are numbered after all signals.
// Two signals for each of `slots` follow, which are their own onsets (replaceable_signals.h).
OnsetSignals onset_signals(const AuralizerInput& input, std::size_t slots = 0);

// The number of kinds of moving sources, those of slots included.
std::size_t kinds_of(const MovingOptions& moving);

}  // namespace clamor
