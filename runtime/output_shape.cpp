#include "runtime/output_shape.h"

#include "runtime/spherical_harmonics.h"

namespace clamor {

Result<OutputShape> OutputShape::asked_for(const std::string& layout, bool ambisonics) {
  if (!layout.empty() && ambisonics)
    return Error("give either --layout or --ambisonics: one file has one kind of channels.");
  OutputShape shape;
  if (ambisonics) shape.kind = Kind::kAmbisonics;
  if (layout.empty()) return shape;
  if (const auto found = find_layout(layout); !found.ok()) return found.error();
  shape.kind = Kind::kLoudspeakers;
  shape.layout = layout;
  return shape;
}

int OutputShape::channels() const {
  if (kind == Kind::kTwoReceivers) return 2;
  return make_panner()->channels();
}

std::vector<Speaker> OutputShape::speakers() const {
  if (kind != Kind::kLoudspeakers) return {};
  return find_layout(layout)->order();
}

std::unique_ptr<Panner> OutputShape::make_panner() const {
  if (kind == Kind::kTwoReceivers) return nullptr;
  if (kind == Kind::kAmbisonics) return make_ambisonic_panner();
  return make_loudspeaker_panner(*find_layout(layout));
}

}  // namespace clamor
