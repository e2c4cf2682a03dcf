// audio_extensions.h: rewrites older glTF audio extensions as KHR_audio_emitter.
//
// | extension          | differences from KHR_audio_emitter                                      |
// |--------------------|-------------------------------------------------------------------------|
// | KHR_audio          | the name; in its first draft sounds are called sources and an emitter    |
// |                    | has one `source`, and `loop`                                            |
// | MSFT_audio_emitter | clips, `volume`, half angles from 0 to pi, an emitter faces +Z, nothing  |
// |                    | is heard outside of the outer cone; the first of several clips is taken  |
// | OMI_audio_emitter  | audioSources or audioClips, audioEmitters, members of `positional`       |
// |                    | beside the others, `audioEmitter` on a node                              |
//
// KhronosGroup/glTF pull request 2137 and its history; the Microsoft vendor extension of
// najadojo/glTF; the first stages of OMI_audio_emitter of the Open Metaverse Interoperability
// Group. MOZ_hubs_components is rewritten by hubs_audio.h.
//
// Malformed members are kept unchanged, so that khr_audio.h reports them.
#pragma once

#include <string_view>

#include "formats/files/json.h"
#include "formats/gltf/import_report.h"

namespace clamor {

inline constexpr std::string_view kKhrAudioEmitter = "KHR_audio_emitter";

// Rewrites the first of these extensions in the document, unless it has KHR_audio_emitter, and the
// sounds of Mozilla Hubs. Others are left unchanged. Reports what was rewritten, features that were
// lost, and audio extensions that are not read.
void rewrite_audio_extensions(Json& document, ImportReport& report);

// Whether an extension is about sound, by its name: it has "audio" or "sound" in it.
bool is_audio_extension(std::string_view name);

}  // namespace clamor
