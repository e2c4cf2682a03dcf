// room.h: a bake file as the place that a report measures: its sources, surfaces and emitters.
//
// Portals are open and movable parts at rest. A large bake gives its sources of highest key only, a
// fair sample of all (expanded_sources.h).
//
// Threads: immutable after construction; any thread may use it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct Room {
  static constexpr std::size_t kMaxSources = 1'000'000;

  // The file must outlive the room. At most `max_sources` are read, and all image sources.
  static Result<Room> read(const BakeFile& file, std::size_t max_sources = kMaxSources);

  const BakeFile* file = nullptr;
  std::vector<Source> sources;  // their emitters are indices of emitters()
  double missing_key = 0;       // see StrongestSources
  // Signals that play instead in instances, in `sources` by the index of an emitter here.
  std::vector<Emitter> playing;
  std::vector<std::uint32_t> playing_of;  // per source: index of `playing`
  Mesh mesh;
  std::unique_ptr<OcclusionGeometry> surfaces;

  const std::vector<Emitter>& emitters() const { return file->emitters(); }
};

// The index of the emitter of that name; the Error proposes the nearest.
Result<std::uint32_t> find_emitter(const std::vector<Emitter>& emitters, const std::string& name);

// Which emitters an impulse comes from: one, by name, or all at once where none of many has enough
// reflections of its own.
struct Excitation {
  std::optional<std::uint32_t> emitter;  // none: all at once
  std::string words;                     // "'violin'", "all 16 416 emitters at once"
  Bands energy_at_10m{};                 // of the same power, in a free field: the reference of G
};

// An empty name chooses the first emitter, or all of a crowd. An Error if the room has no emitters
// or none of that name.
Result<Excitation> excitation_of(const Room& room, const std::string& emitter_name);

// T30 of the bake in the middle octaves, 500 Hz and 1 kHz; 0 if it was not measured.
double middle_t30_s(const Bands& t30_s);

}  // namespace clamor
