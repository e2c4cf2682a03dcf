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

#include <string>
#include <string_view>
#include <vector>

#include "formats/files/json.h"

namespace clamor {

inline constexpr std::string_view kKhrAudioEmitter = "KHR_audio_emitter";

struct RewrittenAudio {
  std::vector<std::string> extensions;  // those that were rewritten
  std::vector<std::string> ignored;  // features that were lost, audio extensions that are not read
};

// Rewrites the first of these extensions in the document, unless it has KHR_audio_emitter, and the
// sounds of Mozilla Hubs. Others are left unchanged.
RewrittenAudio rewrite_audio_extensions(Json& document);

// Whether an extension is about sound, by its name: it has "audio" or "sound" in it.
bool is_audio_extension(std::string_view name);

}  // namespace clamor
