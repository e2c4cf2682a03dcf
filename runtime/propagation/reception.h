// reception.h: directivity of the listener's two receivers, per band (e_r in equation 1 of the
// paper).
//
// A receiver's sensitivity to intensity at the angle a from its axis is ((1 + cos a) / 2)^p, the
// law of emitters (directivity.h): p = 0 is omnidirectional, p = 2 a cardioid microphone. The axes
// turn with the listener's head. Sensitivity is at most 1, so an upper bound for omnidirectional
// receivers is one for all.
//
// A voice gets the gain of each receiver from the receiver's own position. Sampling weighs sources
// by the mean of both receivers, from the centre of the head.
#pragma once

#include <array>
#include <string>

#include "common/bands.h"
#include "common/listener.h"
#include "common/result.h"
#include "common/vec.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct ReceiverPattern {
  Bands exponent{};      // p, 0 to 100
  double angle_rad = 0;  // from straight ahead to the left axis, and mirrored to the right one

  // "omni"; "ortf": two cardioids 110 degrees apart, which with 17 cm between the receivers is the
  // pair of the Office de Radiodiffusion Television Francaise; "wide": wide cardioids (p = 1) on
  // the same axes, which attenuate a source behind the listener by 5.6 dB against one ahead, where
  // cardioids attenuate it by 11.3 dB. Other names are an Error.
  static Result<ReceiverPattern> named(const std::string& name);

  // Power received from a diffuse field, loudness-weighted over the bands, relative to an
  // omnidirectional receiver: the mean of ((1 + cos a) / 2)^p over the sphere is 1 / (p + 1).
  double diffuse_power() const;

  bool operator==(const ReceiverPattern&) const = default;
};

class Reception {
 public:
  Reception() = default;  // omnidirectional
  Reception(const ReceiverPattern& pattern, const Listener& listener);

  bool is_omnidirectional() const { return same_in_all_bands_ && exponent_[0] == 0; }

  // Amplitude gain of a receiver for sound from a direction of any length; a zero vector counts as
  // on the axis.
  Bands gain(int ear, const Vec3f& towards) const;

  // Mean of both receivers' sensitivities to intensity.
  Bands share(const Vec3f& towards) const;

  bool operator==(const Reception&) const = default;

 private:
  Bands shares(int ear, const Vec3f& towards, float times) const;

  Bands exponent_{};
  bool same_in_all_bands_ = true;
  std::array<Vec3f, kEars> axes_{};
};

}  // namespace clamor
