#include "runtime/propagation/intensity_kernel.h"

#include <algorithm>
#include <cstddef>
#include <numbers>

#include "runtime/propagation/received_intensity.h"

// Highway compiles the following once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/propagation/intensity_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/reflection_law-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

constexpr std::size_t kTogether = 16;

// Sources in structure-of-arrays form, and their geometry relative to the receiver.
struct alignas(64) Columns {
  using Column = float[kTogether];
  Column position_m[3], normal[3], mirror[3], radius_m;
  Column lift;  // the base of cos^p is lift + (1 - lift) cos a
  double exact_distance_m[kTogether];
  Column distance_m, spread, cos_o, tilt, log_base, cell_i, cell_o;
};

HWY_INLINE void put(const Source& source, std::size_t i, Columns& columns) {
  const Vec3f& axis = source.axis();
  for (int c = 0; c < 3; ++c) {
    columns.position_m[c][i] = source.position_m[c];
    columns.normal[c][i] = source.normal[c];
    columns.mirror[c][i] = axis[c];
  }
  columns.radius_m[i] = static_cast<float>(source_radius_m(source));
  columns.lift[i] = source.is_emitter ? 0.5f : 0;
}

template <class V>
struct Triple {
  V x, y, z;
};
template <class V>
HWY_INLINE V dot(const Triple<V>& a, const Triple<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

HWY_INLINE void place_some(Columns& columns, const Vec3& place, std::size_t i) {
  const Doubles dd;
  const Halves d;
  using Doubles3 = Triple<hn::Vec<Doubles>>;
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  const auto load = [&](const Columns::Column(&of)[3]) {
    return Doubles3{hn::PromoteTo(dd, hn::Load(d, of[0] + i)),
                    hn::PromoteTo(dd, hn::Load(d, of[1] + i)),
                    hn::PromoteTo(dd, hn::Load(d, of[2] + i))};
  };
  const Doubles3 position = load(columns.position_m);
  const Doubles3 normal = load(columns.normal), mirror = load(columns.mirror);
  const Doubles3 way = {hn::Set(dd, place.x) - position.x, hn::Set(dd, place.y) - position.y,
                        hn::Set(dd, place.z) - position.z};
  const auto distance_m = hn::Sqrt(dot(way, way));
  const auto r_m = hn::DemoteTo(d, distance_m);
  const auto nowhere = hn::Eq(r_m, zero);
  // Division in double, because a lobe of exponent 1000 amplifies its rounding error by 1000.
  const auto over_m = hn::Set(dd, 1.0) / hn::Max(distance_m, hn::Set(dd, 1e-300));
  const auto cos_to = [&](const Doubles3& axis) {
    return hn::DemoteTo(d, dot(way, axis) * over_m);
  };
  const auto cos_i = hn::DemoteTo(d, dot(mirror, normal));
  const auto cos_o = hn::IfThenElse(nowhere, one, cos_to(normal));
  const auto cos_a = hn::Min(hn::IfThenElse(nowhere, cos_i, cos_to(mirror)), one);
  const auto near_m = hn::Max(r_m, hn::Load(d, columns.radius_m + i));
  hn::Store(distance_m, dd, columns.exact_distance_m + i);
  hn::Store(r_m, d, columns.distance_m + i);
  hn::Store(one / (near_m * near_m), d, columns.spread + i);
  hn::Store(cos_o, d, columns.cos_o + i);
  hn::Store(tilt_of(cos_i, cos_o), d, columns.tilt + i);
  const auto lift = hn::Load(d, columns.lift + i);
  hn::Store(log2_of_base(lift + (one - lift) * cos_a), d, columns.log_base + i);
  hn::Store(loss_cell_of(cos_i), d, columns.cell_i + i);
  hn::Store(loss_cell_of(cos_o), d, columns.cell_o + i);
}

HWY_INLINE void add_up(const RadiationTables& tables, const Source& source, const Columns& columns,
                       std::size_t i, Bands& intensity) {
  const Eight d;
  const float cos_o = columns.cos_o[i];
  if (!source.is_emitter && !(cos_o > 0)) {
    intensity = {};
    return;
  }
  const auto to_the = [&](auto p) {  // base^p; results below the range of float become 0
    const auto octaves = p * hn::Set(d, columns.log_base[i]);
    return hn::IfThenElseZero(hn::Ge(octaves, hn::Set(d, -126.0f)), exp2_of(octaves));
  };
  static_assert(kBandCount == 8, "rows of bands fill whole vectors");
  for (std::size_t b = 0; b < kBandCount; b += hn::Lanes(d)) {
    const auto row = [&](const Bands& bands) { return hn::LoadU(d, bands.data() + b); };
    auto power = row(source.power) * hn::Set(d, columns.spread[i]);
    if (source.is_emitter) {
      const auto p = row(tables.emitters[source.emitter].directivity);
      const auto on_axis =
          (p + hn::Set(d, 1.0f)) * hn::Set(d, 0.25f * std::numbers::inv_pi_v<float>);
      power = power * (on_axis * to_the(p));
    } else {
      const ReflectionTable& law = tables.laws[tables.law_of[source.material]];
      const auto cos = hn::Set(d, cos_o);
      if (law.loss.empty()) {
        power = power * (row(law.diffuse) * cos);
      } else {
        const auto loss_at = [&](float cell) {
          const int k = ReflectionTable::cell_at(cell);
          const Bands* const from = law.loss.data() + k;
          return loss_between(row(from[0]), row(from[1]), hn::Set(d, cell - static_cast<float>(k)));
        };
        power = power * density(row(law.diffuse), row(law.lobe), row(law.compensation), cos,
                                hn::Set(d, columns.tilt[i]), to_the(row(law.exponent)),
                                loss_at(columns.cell_i[i]) * loss_at(columns.cell_o[i]));
      }
    }
    const auto air = exp2_of(row(tables.air_log2_loss_per_m) * hn::Set(d, -columns.distance_m[i]));
    hn::StoreU(power * air, d, intensity.data() + b);
  }
}

void receive_here(const RadiationTables& tables, std::span<const Source* const> sources,
                  const Vec3& place, ReceivedIntensity* received) {
  const std::size_t lanes = hn::Lanes(Halves());
  Columns columns;
  for (std::size_t first = 0; first < sources.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, sources.size() - first);
    const std::size_t full = (count + lanes - 1) / lanes * lanes;
    for (std::size_t i = 0; i < full; ++i)
      put(*sources[first + std::min(i, count - 1)], i, columns);
    for (std::size_t i = 0; i < full; i += lanes) place_some(columns, place, i);
    for (std::size_t i = 0; i < count; ++i) {
      ReceivedIntensity& one = received[first + i];
      add_up(tables, *sources[first + i], columns, i, one.intensity);
      one.distance_m = columns.exact_distance_m[i];
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(receive_here);
}  // namespace

void receive(const RadiationTables& tables, std::span<const Source* const> sources,
             const Vec3& place, ReceivedIntensity* received) {
  HWY_DYNAMIC_DISPATCH(receive_here)(tables, sources, place, received);
}

}  // namespace clamor

#endif  // HWY_ONCE
