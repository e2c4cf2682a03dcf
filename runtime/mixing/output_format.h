// output_format.h: what the channels of the output are: two receivers, a head's ears, loudspeakers
// or ambisonic components.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/audio/wav_writer.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/panner.h"
#include "runtime/propagation/reception.h"

namespace clamor {

struct OutputFormat {
  enum class Kind : std::uint8_t { kTwoReceivers, kBinaural, kLoudspeakers, kAmbisonics };
  Kind kind = Kind::kTwoReceivers;
  std::string layout;                // of loudspeakers: "5.1"
  std::shared_ptr<const Hrtf> head;  // binaural
  ReceiverPattern receivers;         // of two

  // From what a user asked for: one of these, or two omnidirectional receivers for none. An Error
  // for more and for a layout or receivers that do not exist.
  static Result<OutputFormat> from_options(bool binaural, const std::string& layout,
                                           bool ambisonics, const std::string& receivers = "");

  int channels() const;
  std::vector<Speaker> speakers() const;  // for the header of a file; empty where they are none

  // Amplitude that makes the loudness (BS.1770) of a diffuse field that of two omnidirectional
  // receivers, so that no kind of output is louder than another. A head already is as loud
  // (hrtf.h). Ambisonics keep 1 by convention: W is what one such receiver hears.
  double diffuse_gain() const;

  // Null for two receivers and for a head.
  std::unique_ptr<Panner> make_panner() const;
};

}  // namespace clamor
