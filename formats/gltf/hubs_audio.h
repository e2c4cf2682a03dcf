// hubs_audio.h: rewrites the sounds of Mozilla Hubs as KHR_audio_emitter.
//
// MOZ_hubs_components is an extension of nodes. These components are read:
//
// | audio          | becomes an emitter: src, autoPlay, loop                                      |
// | audio-params   | is its positional data; audioType "stereo" is global, angles are in degrees. |
// |                | Older levels have these members in `audio`, with `volume` for `gain` | |
// visible        | becomes KHR_node_visibility                                                  |
//
// and others that concern sound (audio-zone, audio-target, video) are reported as ignored.
//
// Hubs-Foundation/hubs-blender-exporter, io_hubs_addon/components/definitions.
#pragma once

#include <string>
#include <vector>

#include "formats/gltf/audio_extensions.h"

namespace clamor {

// Adds the extension to `rewritten` if there were sounds.
void rewrite_hubs_components(Json& document, std::vector<std::string>& rewritten,
                             ImportReport& report);

}  // namespace clamor
