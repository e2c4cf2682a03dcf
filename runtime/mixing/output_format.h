// output_format.h: the meaning of the output channels: two receivers, binaural, loudspeakers or
// Ambisonics.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/propagation/reception.h"

namespace clamor {

class Hrtf;
class Panner;
enum class Speaker : std::uint32_t;

struct OutputFormat {
  enum class Kind : std::uint8_t { kTwoReceivers, kBinaural, kLoudspeakers, kAmbisonics };
  Kind kind = Kind::kTwoReceivers;
  std::string layout;                // of loudspeakers: "5.1"
  std::shared_ptr<const Hrtf> head;  // for binaural
  ReceiverPattern receivers;         // for two receivers

  // The format that a user's options select; two omnidirectional receivers by default. Errors: more
  // than one format, or an unknown layout or receiver pattern.
  static Result<OutputFormat> from_options(bool binaural, const std::string& layout,
                                           bool ambisonics, const std::string& receivers = "");

  int channels() const;
  std::vector<Speaker> speakers()
      const;  // for a file's header; empty if channels are no loudspeakers

  // Gain that makes the loudness (BS.1770) of a diffuse field equal to that of two omnidirectional
  // receivers, so that all formats are equally loud. HRTFs are already normalised (hrtf.h).
  // Ambisonics keep 1 by convention: W is the signal of one such receiver.
  double diffuse_gain() const;

  // Null for two receivers and for binaural output.
  std::unique_ptr<Panner> make_panner() const;
};

}  // namespace clamor
