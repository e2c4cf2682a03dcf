#include "tools/commands/output_options.h"

#include <utility>

#include "runtime/hrtf/hrtf.h"

namespace clamor {

OutputArguments::OutputArguments(Arguments& parser) {
  parser.flag("--headphones", headphones_, "binaural output for headphones; the default");
  parser.option("--hrtf", hrtf_, "SOFA file with the HRTF; implies --headphones [unset: KEMAR]");
  parser.flag("--loudspeakers", loudspeakers_,
              "output for two loudspeakers; implies --receivers wide");
  parser.option("--layout", layout_, "loudspeaker layout: stereo, 5.1, 7.1 or 7.1.4");
  parser.option(
      "--receivers", receivers_,
      "two virtual microphones 17 cm apart: wide (wide cardioids at 110 degrees), ortf (cardioids) "
      "or omni (omnidirectional, as in the paper)");
  parser.words("--layout", {"5.1", "7.1", "7.1.4"});
  parser.words("--receivers", {"wide", "ortf", "omni"});
  parser.flag("--ambisonics", ambisonics_,
              "third-order ambisonics: 16 channels, AmbiX (ACN, SN3D)");
}

bool OutputArguments::asked_for_any() const {
  return headphones_ || !hrtf_.empty() || loudspeakers_ || !layout_.empty() ||
         !receivers_.empty() || ambisonics_;
}

Result<OutputFormat> OutputArguments::read() const {
  if (loudspeakers_ && !receivers_.empty())
    return Error("give either --loudspeakers or --receivers, not both");
  const bool binaural = headphones_ || !hrtf_.empty() || !asked_for_any();
  return OutputFormat::from_options(binaural, layout_, ambisonics_,
                                    loudspeakers_ ? "wide" : receivers_);
}

Result<void> OutputArguments::read_head(OutputFormat& shape, InputFiles& inputs) const {
  if (shape.kind != OutputFormat::Kind::kBinaural) return {};
  auto head = Hrtf::read(hrtf_);
  if (!head.ok() && !asked_for_any())
    return Error(head.error().message +
                 " The default output is for headphones; --loudspeakers needs no HRTF.");
  if (!head.ok()) return head.error();
  inputs.add(hrtf_);
  shape.head = std::move(*head);
  return {};
}

std::string OutputArguments::default_output_note() const {
  if (asked_for_any()) return "";
  return "Mixed for headphones; use --loudspeakers or --layout 5.1 for loudspeakers.";
}

}  // namespace clamor
