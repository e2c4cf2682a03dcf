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
// * Any distance model becomes 1 / r with its level at refDistance, so the gain at 1 m is gain x
//   refDistance. Other rolloffs, models and limits are reported.
// * A global emitter has no position and is ignored with a warning.
//
// Tools that do not know the extension drop or renumber parts of it, so a malformed entry is an
// Error of its own: it costs the emitters that use it and not the level.
#pragma once

#include <optional>
#include <string>
#include <string_view>
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
  bool autoplay = false;
  std::vector<std::size_t> audio;  // encodings of one sound, the preferred one first
  double playback_rate = 1;        // or pitchSpeed: multiplies speed and pitch
};

struct KhrAudio {
  std::string name, uri;
  std::optional<std::size_t> view;
};

struct KhrAudioScene {
  std::vector<Result<KhrEmitter>> emitters;
  std::vector<Result<KhrSource>> sources;
  std::vector<Result<KhrAudio>> audio;
};

// Reads the extension at the root of a glTF document; empty if absent.
KhrAudioScene read_khr_audio(const Json& document);

// The emitters of a node or scene, each once: "emitters": [0, 1] (new), "emitter": 0 (old) or both.
Result<std::vector<std::size_t>> khr_emitters_of(const Json& user);

Error missing_khr_entry(std::string_view key, std::size_t index, std::size_t count);

// Entry `index` of one of the lists, or why there is none; `key` is the member that names it.
template <class T>
Result<const T*> khr_entry(const std::vector<Result<T>>& list, std::string_view key,
                           std::size_t index) {
  if (index >= list.size()) return missing_khr_entry(key, index, list.size());
  if (!list[index].ok()) return list[index].error();
  return &*list[index];
}

// The exponent p of ((1 + cos a) / 2)^p in intensity that matches a cone with gain 1 inside the
// inner and `outer_gain` outside the outer angle, linear in angle between. Full angles in radians.
double exponent_of_cone(double inner_rad, double outer_rad, double outer_gain);

}  // namespace clamor
