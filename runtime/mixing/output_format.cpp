#include "runtime/mixing/output_format.h"

#include <cmath>
#include <numbers>

#include "formats/audio/wav_writer.h"
#include "runtime/mixing/panner.h"
#include "runtime/mixing/spherical_harmonics.h"

namespace clamor {

namespace {

// ITU-R BS.1770-4, table 4: loudspeakers beside the listener at ear level count 1.5 dB more.
double channel_weight(const Loudspeaker& speaker) {
  if (speaker.speaker == Speaker::kLowFrequency) return 0;
  const double azimuth_deg = std::abs(speaker.azimuth_deg);
  const bool is_beside = azimuth_deg >= 60 && azimuth_deg <= 120;
  return is_beside && std::abs(speaker.elevation_deg) < 30 ? 1.41 : 1;
}

// Mean contribution of a layout's loudspeakers to loudness, over all directions.
double diffuse_power(const LoudspeakerLayout& layout) {
  constexpr int kDirections = 4000;  // on a spiral of equal areas; accurate to 0.01 dB
  const auto panner = make_loudspeaker_panner(layout);
  double power = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * i + 1.0) / kDirections, radius = std::sqrt(1 - z * z);
    const double azimuth = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const ChannelGains gains =
        panner->gains(Vec3f(Vec3(radius * std::cos(azimuth), radius * std::sin(azimuth), z)));
    for (std::size_t c = 0; c < layout.speakers.size(); ++c)
      power += channel_weight(layout.speakers[c]) * static_cast<double>(gains[c]) *
               static_cast<double>(gains[c]) / kDirections;
  }
  return power;
}

}  // namespace

Result<OutputFormat> OutputFormat::from_options(bool binaural, const std::string& layout,
                                                bool ambisonics, const std::string& receivers) {
  if (binaural + !layout.empty() + ambisonics + !receivers.empty() > 1)
    return Error(
        "give one of --headphones, --loudspeakers, --layout, --ambisonics and --receivers: output "
        "has "
        "one kind of channels");
  OutputFormat shape;
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

int OutputFormat::channels() const {
  const auto panner = make_panner();
  return panner == nullptr ? 2 : panner->channels();
}

std::vector<Speaker> OutputFormat::speakers() const {
  if (kind != Kind::kLoudspeakers) return {};
  return find_layout(layout)->order();
}

double OutputFormat::diffuse_gain() const {
  switch (kind) {
    case Kind::kTwoReceivers:
      return 1 / std::sqrt(receivers.diffuse_power());
    case Kind::kLoudspeakers:
      return std::sqrt(2 / diffuse_power(*find_layout(layout)));
    case Kind::kBinaural:
    case Kind::kAmbisonics:
      break;
  }
  return 1;
}

std::unique_ptr<Panner> OutputFormat::make_panner() const {
  if (kind == Kind::kTwoReceivers || kind == Kind::kBinaural) return nullptr;
  if (kind == Kind::kAmbisonics) return make_ambisonic_panner();
  return make_loudspeaker_panner(*find_layout(layout));
}

}  // namespace clamor
