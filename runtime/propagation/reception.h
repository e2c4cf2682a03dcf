// reception.h: how loud two receivers hear what comes from each direction: the paper's e_r
// (equation 1), per band.
//
// Intensity from the angle a to a receiver's axis is ((1 + cos a) / 2)^p of that from straight
// ahead of it, the law of emitters (directivity.h): p = 0 hears alike from everywhere, p = 2 is a
// cardioid microphone. The axes turn with the listener. Nothing is louder than on an axis, so that
// whatever bounds the loudness of sources for receivers of p = 0 bounds it for all.
//
// Voices get what each receiver hears, from where it is; the choice of sources weighs them by the
// mean of both, from between them.
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
  double angle_rad = 0;  // from straight ahead to the left receiver's axis; the right one's mirrors

  // "omni"; "ortf": two cardioids 110 degrees apart, which with the 17 cm between our receivers
  // is the pair of the Office de Radiodiffusion Television Francaise; "wide": wide cardioids
  // (p = 1) on the same axes, which hear a source behind the listener 5.6 dB weaker than one
  // ahead, where cardioids hear it 11.3 dB weaker. An Error for other names.
  static Result<ReceiverPattern> named(const std::string& name);

  // Power of what one receiver hears of a diffuse field, loudness-weighted over the bands, against
  // an omnidirectional one: the mean of ((1 + cos a) / 2)^p over the sphere is 1 / (p + 1).
  double diffuse_power() const;

  bool operator==(const ReceiverPattern&) const = default;
};

class Reception {
 public:
  Reception() = default;  // alike from everywhere
  Reception(const ReceiverPattern& pattern, const Listener& pose);

  bool is_omnidirectional() const { return is_alike_ && exponent_[0] == 0; }

  // Amplitude of what reaches a receiver from there; of any length, and none is on its axis.
  Bands gain(int ear, const Vec3f& towards) const;

  // Mean of both receivers' intensities.
  Bands share(const Vec3f& towards) const;

  bool operator==(const Reception&) const = default;

 private:
  Bands shares(int ear, const Vec3f& towards, float times) const;

  Bands exponent_{};
  bool is_alike_ = true;  // in all bands
  std::array<Vec3f, kEars> axes_{};
};

}  // namespace clamor
