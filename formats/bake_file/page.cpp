#include "formats/bake_file/page.h"

#include "common/directivity.h"
#include "formats/level/emitter.h"

namespace clamor {

Source PageColumns::source(std::size_t index) const {
  Source source;
  source.position_m = {position_m[0][index], position_m[1][index], position_m[2][index]};
  source.normal = {normal[0][index], normal[1][index], normal[2][index]};
  source.mirror = {mirror[0][index], mirror[1][index], mirror[2][index]};
  source.delay_s = delay_s[index];
  for (std::size_t b = 0; b < kBandCount; ++b) source.power[b] = power[b][index];
  source.patch_radius_m = patch_radius_m[index];
  source.u = u[index];
  source.emitter = emitter[index];
  source.material = material[index];
  source.polarity = polarity[index];
  source.is_emitter = is_emitter[index] != 0;
  return source;
}

void set_from_emitter(Source& source, const Emitter& emitter) {
  source.is_emitter = true;
  source.polarity = 1;
  source.position_m = Vec3f(emitter.position_m);
  source.normal = source.mirror = Vec3f(emitter.axis);
  source.delay_s = 0;
  source.patch_radius_m = 0;
  source.material = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    source.power[b] =
        static_cast<float>(emitter.gain * emitter.gain * emission_power(emitter.directivity[b]));
}

std::vector<Source> sources_of(const PageColumns& columns) {
  std::vector<Source> sources;
  sources.reserve(columns.count);
  for (std::size_t i = 0; i < columns.count; ++i) sources.push_back(columns.source(i));
  return sources;
}

Result<std::vector<Source>> decode_page(const NodeSummary& node, std::span<const std::byte> page,
                                        std::span<const Emitter> emitters, std::size_t materials) {
  PageDecoder decoder;
  const auto columns = std::make_unique<PageColumns>();
  const auto done = decoder.decode_unpacked(node, page, emitters, materials, *columns);
  if (!done.ok()) return done.error();
  return sources_of(*columns);
}

}  // namespace clamor
