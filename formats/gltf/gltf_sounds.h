// gltf_sounds.h: reads the emitters of a glTF scene and their sounds.
//
// KHR_audio_emitter (khr_audio.h) defines positions and sounds. Clamor's own extension adds:
//
//   "extensions": { "CLAMOR_emitter": {       on the node, or on the KHR emitter; or in
//     "directivity": 2 | [8],  "bandsHz": [],  extras.clamor_emitter of either. The node wins.
//     "gain_db": -3,           added to KHR's gain
//     "delay_s": 0.1,          start after time 0
//     "random_delay_s": 0.3    additional random delay in [0, this), different for every emitter
//   } }
//
// A node with EXT_mesh_gpu_instancing emits from every instance, each delayed by its attribute
// _DELAY_S, if present. Every source of a KHR emitter becomes an Emitter.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/audio/audio_file.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"
#include "formats/level/emitter.h"
#include "formats/level/signal_table.h"

namespace clamor {

struct SceneSounds {
  std::vector<Emitter> emitters;
  std::vector<int> nodes;  // node of each emitter
};

Result<SceneSounds> read_scene_sounds(const GltfScene& scene,
                                      const std::vector<PlacedNode>& placements,
                                      LevelFolder& folder, SignalTable& signals, std::uint64_t seed,
                                      ImportReport& report);

// Reports what averaging the channels of a sound did to it.
void report_downmix(const Downmix& downmix, const std::string& name, ImportReport& report);

// A start delay in [0, max_s) for emitter `index`, a function of seed and index.
double random_start_s(std::uint64_t seed, std::size_t index, double max_s);

}  // namespace clamor
