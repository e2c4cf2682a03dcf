#include "tools/commands/output_options.h"

#include <utility>

namespace clamor {

OutputArguments::OutputArguments(Arguments& parser) {
  parser.flag("--headphones", headphones_,
              "through a dummy head's ears (binaural); this is the default");
  parser.flag("--binaural", binaural_, "another word for --headphones");
  parser.option("--hrtf", hrtf_, "the head: a SOFA file; unset: KEMAR. Means --headphones");
  parser.flag("--loudspeakers", loudspeakers_, "for two loudspeakers; means --receivers wide");
  parser.option("--layout", layout_, "for more loudspeakers: 5.1, 7.1 or 7.1.4");
  parser.option(
      "--receivers", receivers_,
      "two microphones 17 cm apart: wide, two wide cardioids 110 degrees apart; ortf, two "
      "cardioids; or omni, alike from everywhere, as in the paper");
  parser.flag("--ambisonics", ambisonics_, "order 3 instead, 16 channels of AmbiX (ACN, SN3D)");
}

bool OutputArguments::asked_for_any() const {
  return headphones_ || binaural_ || !hrtf_.empty() || loudspeakers_ || !layout_.empty() ||
         !receivers_.empty() || ambisonics_;
}

Result<OutputFormat> OutputArguments::read() const {
  if (loudspeakers_ && !receivers_.empty())
    return Error("give one of --loudspeakers and --receivers: output has one kind of channels");
  const bool binaural = headphones_ || binaural_ || !hrtf_.empty() || !asked_for_any();
  return OutputFormat::from_options(binaural, layout_, ambisonics_,
                                    loudspeakers_ ? "wide" : receivers_);
}

Result<void> OutputArguments::read_head(OutputFormat& shape, InputFiles& inputs) const {
  if (shape.kind != OutputFormat::Kind::kBinaural) return {};
  auto head = Hrtf::read(hrtf_);
  if (!head.ok() && !asked_for_any())
    return Error(head.error().message +
                 " The default output is for headphones; --loudspeakers needs no head.");
  if (!head.ok()) return head.error();
  inputs.add(hrtf_);
  shape.head = std::move(*head);
  return {};
}

std::string OutputArguments::default_output_note() const {
  if (asked_for_any()) return "";
  return "This is mixed for headphones; --loudspeakers or --layout 5.1 is for loudspeakers.";
}

}  // namespace clamor
