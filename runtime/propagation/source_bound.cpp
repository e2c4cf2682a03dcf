#include "runtime/propagation/source_bound.h"

#include <algorithm>

#include "runtime/propagation/received_intensity.h"

namespace clamor {

SourceBound source_bound(const RadiationModel& radiation, const Source& source,
                         const RadiationModel::UpperBound& at_1m) {
  const float boost = radiation.late_boost().at(source.delay_s);
  const double over_u = kFloatSlack * (1 + static_cast<double>(boost)) / std::max(source.u, kMinU);
  const auto radius_m = static_cast<float>(source_radius_m(source));
  return {source.position_m,
          source.normal,
          source.axis(),
          radius_m * radius_m * kRadius2Slack,
          static_cast<float>(at_1m.diffuse * over_u),
          static_cast<float>(at_1m.compensation * over_u),
          static_cast<float>(at_1m.lobe * over_u),
          at_1m.fall,
          source.is_emitter ? -1 : at_1m.slope,
          boost};
}

}  // namespace clamor
