// room_summary.h: what a room sounds like, in a sentence, and what makes it so.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/enclosure.h"
#include "formats/level/mesh.h"

namespace clamor {

struct ParameterKind;
struct RoomResponse;

// Mean over the listeners and the octaves of 500 Hz and 1 kHz, as ISO 3382-1 judges rooms.
std::optional<double> middle_value(std::span<const RoomResponse> responses,
                                   const ParameterKind& kind);

// T30 at 125 and 250 Hz over that at 500 Hz and 1 kHz: above 1.2 a room sounds warm, and much above
// that it booms (L. Beranek. Concert Halls and Opera Houses, 2004).
std::optional<double> bass_ratio(std::span<const RoomResponse> responses);

// The power that photons brought to a material. Surfaces that no sound reaches (outer faces, parts
// that the bake leaves out) do not count, however large they are.
struct MetMaterial {
  std::string name;
  Bands absorption{}, transmission{};
  Bands arrived{};  // power that arrived, each time that sound met it

  double dissipated(std::size_t band) const {
    return static_cast<double>(arrived[band]) *
           static_cast<double>(absorption[band] - transmission[band]);
  }
};

// Lists the materials, those that absorb most first. Materials of equal values are one
// (bake_overview.h). A file of an older program does not know them: the list is empty.
std::vector<MetMaterial> met_materials(const BakeFile& file);

// What a material's absorption changes: d T30 / d absorption in each octave, 0 where there is no
// T30.
struct DecidingMaterial {
  std::string name;
  Bands slope_s{};
};

// The materials by which the decay is decided, those first that change it most. A room's energy
// decays at the rate
//
//     6 ln 10 / T = -c / l ln(1 - sum over m of f_m a_m) + c air loss,
//
// with l the mean free path and f_m the share of the sound that meets material m, so that
// d T / d a_m = -T^2 / (6 ln 10) c / l f_m / (1 - sum f a). (C. F. Eyring. Reverberation Time in
// "Dead" Rooms. J. Acoust. Soc. Am. 1, 1930.) Assumes one path length for all sound.
std::vector<DecidingMaterial> deciding_materials(const BakeFile& file);

// By material.
std::vector<double> areas_m2(const Mesh& mesh, std::size_t materials);

// "It reverberates for 1.1 s, like a theatre. ..." Of a crowd that sounds all at once, only its
// decay says something of the room.
// A level that is mostly open is compared with no room.
std::string described(std::span<const RoomResponse> responses, Enclosure enclosure,
                      bool is_crowd = false);

// What makes a room boom, or ring for long, and how to mend it; empty if it does neither.
// The first form judges by what was measured at listeners, the second by the T30 of the bake.
std::string cause_of_decay(std::span<const RoomResponse> responses,
                           std::span<const MetMaterial> materials);
std::string cause_of_decay(const DecaySummary& decay, std::span<const MetMaterial> materials);
// `bass_ratio` as of bass_ratio(), `t30_s` of the octaves of 500 Hz and 1 kHz.
std::string cause_of_decay(std::optional<double> bass_ratio, std::optional<double> t30_s,
                           std::span<const MetMaterial> materials);

}  // namespace clamor
