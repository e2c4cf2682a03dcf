// khr_audio.h: reads KHR_audio_emitter in its old and new spelling. Other audio extensions are
// first rewritten as this one (audio_extensions.h).
//
// The draft extension has artistic attenuation curves, Clamor physical ones. They are mapped as
// follows:
//
// * A cone becomes the directivity exponent p that radiates the same power with the same level on
// the
//   axis, p = 4 pi / P - 1, with P the squared gain of the cone integrated over the sphere. The
//   direct sound on the axis and the reverberation are exact; the edge of the cone is smoothed.
// * Any distance model becomes 1 / r. The designer's curve has its gain at refDistance, so the gain
// at
//   1 m is gain x refDistance. Other rolloffs, models and limits are reported.
// * A global emitter has no position and is ignored with a warning.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/json.h"

namespace clamor {

struct KhrEmitter {
  std::string name;
  bool global = false;
  double gain = 1;  // amplitude at 1 m on the axis, including refDistance
  double directivity = 0;
  bool faces_plus_z = false;  // the axis is +Z of the node instead of -Z
  std::vector<std::size_t> sources;
  std::vector<std::string> notes;  // features that were approximated
};

struct KhrSource {
  std::string name;
  double gain = 1;
  bool loop = false;
  std::optional<std::size_t> audio;
  double playback_rate = 1;
};

struct KhrAudio {
  std::string name, uri;
  std::optional<std::size_t> view;
};

struct KhrAudioScene {
  std::vector<KhrEmitter> emitters;
  std::vector<KhrSource> sources;
  std::vector<KhrAudio> audio;
};

// Reads the extension at the root of a glTF document; empty if absent.
Result<KhrAudioScene> read_khr_audio(const Json& document);

// The emitters of a node or scene: "emitters": [0, 1] (new) or "emitter": 0 (old).
Result<std::vector<std::size_t>> khr_emitters_of(const Json& node, const KhrAudioScene& audio);

// The exponent p of ((1 + cos a) / 2)^p in intensity that matches a cone with gain 1 inside the
// inner and `outer_gain` outside the outer angle, linear in angle between. Full angles in radians.
double exponent_of_cone(double inner_rad, double outer_rad, double outer_gain);

}  // namespace clamor
