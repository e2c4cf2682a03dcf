// gltf_sounds.h: the emitters of a glTF scene and the sounds they play.
//
// KHR_audio_emitter says where and what (khr_audio.h). Clamor's own extension adds what it cannot:
//
//   "extensions": { "CLAMOR_emitter": {       on the node, or on the KHR emitter; or in
//     "directivity": 2 | [8],  "bandsHz": [],  extras.clamor_emitter of either. The node wins.
//     "gain_db": -3,           added to KHR's gain
//     "delay_s": 0.1,          later than time 0
//     "random_delay_s": 0.3    and by a random time from [0, this), another for every emitter
//   } }
//
// A node with EXT_mesh_gpu_instancing emits from every instance, each later by what its own
// attribute _DELAY_S says, if there is one; every source of an emitter is an Emitter of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/level/level.h"
#include "formats/level/level_folder.h"
#include "formats/level/signal_table.h"

namespace clamor {

struct SceneSounds {
  std::vector<Emitter> emitters;
  std::vector<int> nodes;  // that of each emitter
  std::vector<std::string> ignored, warnings;
};

Result<SceneSounds> read_scene_sounds(const GltfScene& scene,
                                      const std::vector<PlacedNode>& placements,
                                      LevelFolder& folder, SignalTable& signals,
                                      std::uint64_t seed);

// A start delay in [0, most_s) for emitter `index`, the same for every seed and index.
double random_start_s(std::uint64_t seed, std::size_t index, double most_s);

}  // namespace clamor
