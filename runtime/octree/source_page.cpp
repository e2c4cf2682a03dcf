#include "runtime/octree/source_page.h"

#include <algorithm>
#include <utility>

#include "runtime/field/received_intensity.h"

namespace clamor {

SieveSource sieve_source(const SourceField& field, const Bands& weight, const Source& source) {
  const SourceField::Ceiling ceiling = field.ceiling(source, weight);
  const double over_u = 1.00001 * (1 + static_cast<double>(field.late_boost().at(source.delay_s))) /
                        std::max(source.u, kLeastU);
  return {source.position_m,
          source.normal,
          source.mirror,
          static_cast<float>(source_radius_m(source)),
          static_cast<float>(ceiling.diffuse * over_u),
          static_cast<float>(ceiling.bounce * over_u),
          ceiling.slope,
          static_cast<float>(ceiling.lobe * over_u),
          ceiling.fall,
          source.is_emitter,
          source.delay_s,
          source.emitter,
          ceiling.mix};
}

SourcePage::SourcePage(const SourceField& field, std::span<const Bands> weights,
                       std::vector<Source> sources)
    : sources_(std::move(sources)) {
  std::vector<SieveSource> some;
  some.reserve(kSieveSources);
  sieves_.reserve((size() + kSieveSources - 1) / kSieveSources);
  for (std::size_t first = 0; first < size(); first += kSieveSources) {
    some.clear();
    for (std::size_t i = first; i < std::min(first + kSieveSources, size()); ++i)
      some.push_back(sieve_source(field, weights[field.signal(sources_[i])], sources_[i]));
    sieves_.emplace_back(some);
  }
  bytes_ = sizeof(SourcePage) + size() * sizeof(Source);
  for (const SourceSieve& sieve : sieves_) bytes_ += sieve.bytes();
}

}  // namespace clamor
