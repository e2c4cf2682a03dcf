#include "runtime/query/source_page.h"

#include <algorithm>
#include <utility>

#include "runtime/propagation/received_intensity.h"
#include "runtime/query/query_constants.h"

namespace clamor {

CullSource cull_source(const RadiationModel& field, const Bands& weight, const Source& source) {
  const RadiationModel::UpperBound bound = field.upper_bound(source, weight);
  const double over_u = query::kCullerKeySlack *
                        (1 + static_cast<double>(field.late_boost().at(source.delay_s))) /
                        std::max(source.u, kMinU);
  return {source.position_m,
          source.normal,
          source.mirror,
          static_cast<float>(source_radius_m(source)),
          static_cast<float>(bound.diffuse * over_u),
          static_cast<float>(bound.compensation * over_u),
          bound.slope,
          static_cast<float>(bound.lobe * over_u),
          bound.fall,
          source.is_emitter,
          source.delay_s,
          source.emitter,
          bound.mix};
}

SourcePage::SourcePage(const RadiationModel& field, std::span<const Bands> weights,
                       std::vector<Source> sources)
    : sources_(std::move(sources)) {
  std::vector<CullSource> some;
  some.reserve(kCullerSources);
  cullers_.reserve((size() + kCullerSources - 1) / kCullerSources);
  for (std::size_t first = 0; first < size(); first += kCullerSources) {
    some.clear();
    for (std::size_t i = first; i < std::min(first + kCullerSources, size()); ++i)
      some.push_back(cull_source(field, weights[field.signal(sources_[i])], sources_[i]));
    cullers_.emplace_back(some);
  }
  bytes_ = sizeof(SourcePage) + size() * sizeof(Source);
  for (const SourceCuller& sieve : cullers_) bytes_ += sieve.bytes();
}

}  // namespace clamor
