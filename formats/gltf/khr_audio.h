// khr_audio.h: KHR_audio_emitter in its old and new spelling, as we understand it. Other audio
// extensions are rewritten as this one first (audio_extensions.h).
//
// The extension is a draft whose curves are a designer's, ours are physical; what is made of them:
//
// * A cone becomes the directivity exponent p that radiates the same power with the same level on
//   the axis, p = 4 pi / P - 1 with P the cone's mean-square gain summed over the sphere. So the
//   direct sound in front and the reverberation are right; the edge of the cone is rounder.
// * Any distance model becomes 1 / r. refDistance is where the designer's curve has its gain, so
//   the gain at 1 m is gain x refDistance. Other rolloffs, models and limits are reported.
// * A global emitter has no place and is ignored, with a warning.
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
  double gain = 1;  // amplitude at 1 m on the axis, refDistance included
  double directivity = 0;
  bool faces_plus_z = false;  // its axis is the node's +Z, not -Z (audio_extensions.h)
  std::vector<std::size_t> sources;
  std::vector<std::string> notes;  // what was understood differently than it was meant
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

// The extension at the root of a glTF document; empty where it has none.
Result<KhrAudioScene> read_khr_audio(const Json& document);

// Which emitters a node (or scene) names: "emitters": [0, 1] (new) or "emitter": 0 (old).
Result<std::vector<std::size_t>> khr_emitters_of(const Json& node, const KhrAudioScene& audio);

// The p of ((1 + cos a) / 2)^p on intensity for a cone of full angles in radians, with gain 1
// inside the inner, `outer_gain` outside the outer, linear in angle between.
double exponent_of_cone(double inner_rad, double outer_rad, double outer_gain);

}  // namespace clamor
