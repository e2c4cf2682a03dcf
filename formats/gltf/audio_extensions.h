// audio_extensions.h: the glTF audio extensions that came before KHR_audio_emitter, rewritten as
// it.
//
// | extension          | what differs                                                            |
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
// Group.
//
// Malformed members are passed on as they are, so that khr_audio.h complains of them.
#pragma once

#include <string>
#include <vector>

#include "formats/files/json.h"

namespace clamor {

struct RewrittenAudio {
  std::string extension;             // empty if there was none to rewrite
  std::vector<std::string> ignored;  // what could not be kept
};

// Rewrites the first of these extensions that the document has; if it has KHR_audio_emitter, or
// several, the others are left alone.
RewrittenAudio rewrite_audio_extensions(Json& document);

}  // namespace clamor
