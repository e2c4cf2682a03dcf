#include "tools/output_options.h"

#include <utility>

namespace clamor {

OutputWords::OutputWords(Arguments& parser) {
  parser.flag("--binaural", binaural_, "for headphones, through a dummy head's ears");
  parser.option("--hrtf", hrtf_, "the head: a SOFA file; unset: KEMAR. Means --binaural");
  parser.option("--layout", layout_, "loudspeakers: 5.1, 7.1 or 7.1.4; unset: stereo");
  parser.option(
      "--receivers", receivers_,
      "of two channels: omni, alike from everywhere, or ortf, two cardioids; unset: omni");
  parser.flag("--ambisonics", ambisonics_, "order 3 instead, 16 channels of AmbiX (ACN, SN3D)");
}

Result<OutputShape> OutputWords::read() const {
  return OutputShape::asked_for(binaural_ || !hrtf_.empty(), layout_, ambisonics_, receivers_);
}

Result<void> OutputWords::read_head(OutputShape& shape) const {
  if (shape.kind != OutputShape::Kind::kBinaural) return {};
  auto head = Head::read(hrtf_);
  if (!head.ok()) return head.error();
  shape.head = std::move(*head);
  return {};
}

}  // namespace clamor
