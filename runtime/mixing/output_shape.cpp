#include "runtime/mixing/output_shape.h"

#include "runtime/mixing/spherical_harmonics.h"

namespace clamor {

Result<OutputShape> OutputShape::asked_for(bool binaural, const std::string& layout,
                                           bool ambisonics, const std::string& receivers) {
  if (binaural + !layout.empty() + ambisonics + !receivers.empty() > 1)
    return Error(
        "give one of --binaural, --layout, --ambisonics and --receivers: output has one kind of "
        "channels");
  OutputShape shape;
  if (!receivers.empty()) {
    const auto pattern = ReceiverPattern::named(receivers);
    if (!pattern.ok()) return Error("--receivers: " + pattern.error().message);
    shape.receivers = *pattern;
  }
  if (binaural) shape.kind = Kind::kBinaural;
  if (ambisonics) shape.kind = Kind::kAmbisonics;
  if (layout.empty()) return shape;
  if (const auto found = find_layout(layout); !found.ok()) return found.error();
  shape.kind = Kind::kLoudspeakers;
  shape.layout = layout;
  return shape;
}

int OutputShape::channels() const {
  const auto panner = make_panner();
  return panner == nullptr ? 2 : panner->channels();
}

std::vector<Speaker> OutputShape::speakers() const {
  if (kind != Kind::kLoudspeakers) return {};
  return find_layout(layout)->order();
}

std::unique_ptr<Panner> OutputShape::make_panner() const {
  if (kind == Kind::kTwoReceivers || kind == Kind::kBinaural) return nullptr;
  if (kind == Kind::kAmbisonics) return make_ambisonic_panner();
  return make_loudspeaker_panner(*find_layout(layout));
}

}  // namespace clamor
