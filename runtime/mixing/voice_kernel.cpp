#include "runtime/mixing/voice_kernel.h"

#include <algorithm>
#include <cmath>

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/mixing/voice_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/reflection_law-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// The lookup of itd_table.h, in the order of operations of its scalar code.
template <class D, class V>
HWY_INLINE V itd_of(D d, V x, V y, V z, const float* table) {
  const hn::RebindToSigned<D> di;
  constexpr int kCells = ItdTable::kCells, kRow = kCells + 1;
  const auto one = hn::Set(d, 1.0f);
  const auto scale = one / (hn::Abs(x) + hn::Abs(y) + hn::Abs(z));
  const auto a = x * scale, b = y * scale;
  const auto below = hn::Lt(z, hn::Zero(d));
  const auto u = hn::IfThenElse(below, hn::CopySign(one - hn::Abs(b), a), a);
  const auto v = hn::IfThenElse(below, hn::CopySign(one - hn::Abs(a), b), b);
  const auto half = hn::Set(d, kCells / 2.0f);
  const auto across = (u + one) * half, along = (v + one) * half;
  const auto last = hn::Set(di, kCells - 1), first = hn::Zero(di);
  const auto i = hn::Min(hn::Max(hn::ConvertTo(di, across), first), last);
  const auto j = hn::Min(hn::Max(hn::ConvertTo(di, along), first), last);
  const auto s = across - hn::ConvertTo(d, i), t = along - hn::ConvertTo(d, j);
  const auto at = hn::Add(hn::Mul(j, hn::Set(di, kRow)), i);
  const auto corner00 = hn::GatherIndex(d, table, at);
  const auto corner01 = hn::GatherIndex(d, table + 1, at);
  const auto corner10 = hn::GatherIndex(d, table + kRow, at);
  const auto corner11 = hn::GatherIndex(d, table + kRow + 1, at);
  const auto low = corner00 + s * (corner01 - corner00);
  const auto high = corner10 + s * (corner11 - corner10);
  return low + t * (high - low);
}

using Float = hn::Vec<Halves>;
using Double = hn::Vec<Doubles>;

template <class V>
struct Triple {
  V x, y, z;
};
template <class V>
HWY_INLINE V dot(const Triple<V>& a, const Triple<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class D>
HWY_INLINE Triple<hn::Vec<D>> in_all_lanes(D d, const Vec3& v) {
  using T = hn::TFromD<D>;
  return {hn::Set(d, static_cast<T>(v.x)), hn::Set(d, static_cast<T>(v.y)),
          hn::Set(d, static_cast<T>(v.z))};
}
HWY_INLINE Triple<Float> load(const std::array<VoiceColumn, 3>& columns, std::size_t at) {
  const Halves d;
  return {hn::LoadU(d, columns[0].data() + at), hn::LoadU(d, columns[1].data() + at),
          hn::LoadU(d, columns[2].data() + at)};
}
HWY_INLINE Triple<Double> promoted(const Triple<Float>& v) {
  const Doubles dd;
  return {hn::PromoteTo(dd, v.x), hn::PromoteTo(dd, v.y), hn::PromoteTo(dd, v.z)};
}
HWY_INLINE Triple<Double> from_to(const Triple<Double>& from, const Vec3& place) {
  const auto to = in_all_lanes(Doubles(), place);
  return {to.x - from.x, to.y - from.y, to.z - from.z};
}

// The sources of consecutive slots, the first of which is `at`.
struct SourceLanes {
  std::size_t at;
  Triple<Double> position;
  Triple<Float> normal, mirror;
};

// From the sources to the listener.
struct Path {
  Path(const Triple<Double>& way, const SourceLanes& sources)
      : towards{hn::DemoteTo(Halves(), way.x), hn::DemoteTo(Halves(), way.y),
                hn::DemoteTo(Halves(), way.z)},
        length(hn::Sqrt(dot(way, way))),
        along_normal(hn::DemoteTo(Halves(), dot(way, promoted(sources.normal)))) {}

  Triple<Float> towards;
  Double length;
  Float along_normal;  // double until here, because differences near the surface are small
};

// To an ear beside the centre, from the position of the source when the sound for that ear left it.
HWY_INLINE Triple<Double> way_from_moving(const Triple<Double>& w, const Triple<Double>& m,
                                          Double age) {
  const Doubles dd;
  const Double b = age - dot(w, m);
  const Double rest = hn::Set(dd, 1) - dot(m, m);
  const Double under = b * b - rest * (age * age - dot(w, w));
  const Double later = (b - hn::Sqrt(hn::Max(under, hn::Zero(dd)))) / rest;
  return {w.x - m.x * later, w.y - m.y * later, w.z - m.z * later};
}

// Where they are heard from, in the listener's axes; straight ahead inside the head.
HWY_INLINE Triple<Float> direction_of(const Path& to_centre, Float centre_m,
                                      const ListenerFrame& listener) {
  const Halves d;
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  const auto inside = hn::Le(centre_m, hn::Set(d, 1e-6f));
  const Float over_m = hn::Div(one, hn::IfThenElse(inside, one, centre_m));
  const auto along = [&](const Vec3& axis, Float if_inside) {
    const Float from = hn::Neg(dot(to_centre.towards, in_all_lanes(d, axis)) * over_m);
    return hn::IfThenElse(inside, if_inside, from);
  };
  return {along(listener.ahead, one), along(listener.left, zero), along(listener.up, zero)};
}

HWY_INLINE void arrive(VoiceTable& table, const SourceLanes& sources, const Path& path, Float r_m,
                       int ear) {
  const Halves d;
  const auto one = hn::Set(d, 1.0f);
  const auto nowhere = hn::Eq(r_m, hn::Zero(d));
  const Float over_r = hn::Div(one, hn::IfThenElse(nowhere, one, r_m));
  const Float near_m = hn::Max(r_m, hn::LoadU(d, table.geometry.radius_m.data() + sources.at));
  const Float cos_o = hn::IfThenElse(nowhere, one, path.along_normal * over_r);
  const Float cos_a = hn::Min(hn::IfThenElse(nowhere, dot(sources.normal, sources.mirror),
                                             dot(path.towards, sources.mirror) * over_r),
                              one);
  const Float lift = hn::LoadU(d, table.geometry.lift.data() + sources.at);
  const auto store = [&](Float value, std::array<VoiceColumn, kEars>& column) {
    hn::StoreU(value, d, column[ear].data() + sources.at);
  };
  store(one / (near_m * near_m), table.arrivals.spread);
  store(cos_o, table.arrivals.cos_o);
  store(loss_cell_of(cos_o), table.arrivals.loss_cell);
  store(log2_of_base(lift + (one - lift) * cos_a), table.arrivals.log_base);
}

void place_voices_here(VoiceTable& table, const ListenerFrame& listener, const float* itd_table,
                       std::size_t first, std::size_t last, bool delays_only) {
  const Doubles dd;
  const Halves d;
  for (std::size_t at = first; at < last; at += hn::Lanes(d)) {
    const SourceLanes sources{at, promoted(load(table.geometry.position_m, at)),
                              load(table.geometry.normal, at), load(table.geometry.mirror, at)};
    const Path to_centre(from_to(sources.position, listener.centre_m), sources);
    const Float centre_m = hn::DemoteTo(d, to_centre.length);
    const Triple<Float> from = direction_of(to_centre, centre_m, listener);
    hn::StoreU(from.x, d, table.arrivals.from[0].data() + at);
    hn::StoreU(from.y, d, table.arrivals.from[1].data() + at);
    hn::StoreU(from.z, d, table.arrivals.from[2].data() + at);

    const bool moves = table.geometry.moves[at / VoiceTable::kTile];
    const Double emission = hn::LoadU(dd, table.geometry.emission_frames.data() + at);
    const auto frames_along = [&](const Path& path) {
      return emission + path.length * hn::Set(dd, table.geometry.frames_per_m);
    };
    if (listener.places == 1) {
      hn::StoreU(centre_m, d, table.arrivals.distance_m[0].data() + at);
      if (!delays_only) arrive(table, sources, to_centre, centre_m, 0);
      Double half_itd = hn::Zero(dd);
      if (itd_table != nullptr)
        half_itd =
            hn::PromoteTo(dd, itd_of(d, from.x, from.y, from.z, itd_table)) * hn::Set(dd, 0.5);
      const Double frames = frames_along(to_centre);
      hn::StoreU(frames - half_itd, dd, table.arrivals.delay_frames[0].data() + at);
      hn::StoreU(frames + half_itd, dd, table.arrivals.delay_frames[1].data() + at);
      continue;
    }
    for (int e = 0; e < listener.places; ++e) {
      Triple<Double> way = from_to(sources.position, listener.ear_positions_m[e]);
      if (moves)
        way = way_from_moving(way, promoted(load(table.geometry.mach, at)), to_centre.length);
      const Path path(way, sources);
      const Float path_m = hn::DemoteTo(d, path.length);
      hn::StoreU(path_m, d, table.arrivals.distance_m[e].data() + at);
      if (!delays_only) arrive(table, sources, path, path_m, e);
      hn::StoreU(frames_along(path), dd, table.arrivals.delay_frames[e].data() + at);
    }
  }
}

// The bands of one ear, or of both in one vector if it is wide enough.
struct OneEar {
  Eight d;
  std::size_t ear;

  auto row(const float* rows) const { return hn::LoadU(d, rows); }
  auto rows(const float* const (&of)[kEars], std::size_t b) const {
    return hn::LoadU(d, of[ear] + b);
  }
  auto each(const float (&of)[kEars]) const { return hn::Set(d, of[ear]); }
};
#if HWY_MAX_BYTES >= 64
struct BothEars {
  hn::CappedTag<float, kEars * kBandCount> d;
  Eight half;

  auto both(hn::Vec<Eight> first, hn::Vec<Eight> second) const {
    return hn::Combine(d, second, first);
  }
  auto row(const float* rows) const { return both(hn::LoadU(half, rows), hn::LoadU(half, rows)); }
  auto rows(const float* const (&of)[kEars], std::size_t /*b*/) const {
    return both(hn::LoadU(half, of[0]), hn::LoadU(half, of[1]));
  }
  auto each(const float (&of)[kEars]) const {
    return both(hn::Set(half, of[0]), hn::Set(half, of[1]));
  }
};
#endif

// Factors of a voice's gains with one value per ear.
struct PerEar {
  float away_m[kEars] = {}, outer[kEars] = {}, cos_o[kEars] = {}, log_base[kEars] = {};
  float tilt[kEars] = {}, part[kEars] = {};
  const float *loss[kEars] = {}, *next_loss[kEars] = {};
};

template <class Ears>
HWY_INLINE void make_gains(const Ears& ears, const VoiceRadiation& radiation, std::size_t slot,
                           const PerEar& at, float* HWY_RESTRICT gain) {
  static_assert(kBandCount == 8, "rows of bands fill whole vectors");
  const auto d = ears.d;
  const VoiceRadiation::Kind kind = radiation.kind[slot];
  const ReflectionTable* const law = radiation.law[slot];
  const float* const exponent = radiation.exponent[slot];
  const auto power_of_base = [&](std::size_t b) {
    return exp2_of(ears.row(exponent + b) * ears.each(at.log_base));
  };
  for (std::size_t b = 0; b < kBandCount; b += hn::Lanes(d)) {
    const auto row = [&](const Bands& bands) { return ears.row(bands.data() + b); };
    auto intensity = row(radiation.power[slot]);
    if (kind == VoiceRadiation::kEmitter) {
      intensity = intensity * power_of_base(b);
    } else if (kind == VoiceRadiation::kDiffuse) {
      intensity = intensity * (row(law->diffuse) * ears.each(at.cos_o));
    } else if (kind == VoiceRadiation::kReflection) {
      intensity = radiated(
          intensity, row(law->diffuse), row(law->lobe), row(radiation.compensation[slot]),
          ears.each(at.cos_o), ears.each(at.tilt), power_of_base(b),
          loss_between(ears.rows(at.loss, b), ears.rows(at.next_loss, b), ears.each(at.part)));
    }
    const auto air = exp2_of(row(radiation.air_log2_loss_per_m) * ears.each(at.away_m));
    intensity = intensity * ears.each(at.outer) * (air * row(radiation.power_gain[slot]));
    // The square root from the bake's power to the mixer's amplitude.
    hn::StoreU(hn::Sqrt(intensity) * hn::Set(d, radiation.sign[slot]), d, gain + b);
  }
}

HWY_INLINE void make_voice(const VoiceTable& table, std::size_t places, std::size_t slot,
                           Voice& voice) {
  const VoiceRadiation& radiation = table.radiation;
  const VoiceArrivals& arrivals = table.arrivals;
  const VoiceRadiation::Kind kind = radiation.kind[slot];
  PerEar at;
  bool audible = false;
  for (std::size_t e = 0; e < places; ++e) {
    const float cos_o = arrivals.cos_o[e][slot];
    const bool behind = kind >= VoiceRadiation::kDiffuse && !(cos_o > 0);  // its surface
    audible |= !behind;
    at.away_m[e] = -arrivals.distance_m[e][slot];
    at.outer[e] = behind ? 0 : arrivals.spread[e][slot] * radiation.scale[slot];
    at.cos_o[e] = behind ? 0 : cos_o;
    at.log_base[e] = arrivals.log_base[e][slot];
    if (kind != VoiceRadiation::kReflection) continue;
    at.tilt[e] = std::min(1.0f, at.cos_o[e] * radiation.inverse_cos_i[slot]);
    const float cell = arrivals.loss_cell[e][slot];
    const int k = ReflectionTable::cell_at(cell);
    at.part[e] = cell - static_cast<float>(k);
    at.loss[e] = radiation.law[slot]->loss[static_cast<std::size_t>(k)].data();
    at.next_loss[e] = at.loss[e] + kBandCount;
  }
  if (!audible) {
    voice.gain = {};
    return;
  }
#if HWY_MAX_BYTES >= 64
  if (places == kEars) {
    make_gains(BothEars{}, radiation, slot, at, voice.gain[0].data());
    return;
  }
#endif
  for (std::size_t e = 0; e < places; ++e)
    make_gains(OneEar{{}, e}, radiation, slot, at, voice.gain[e].data());
  if (places == 1) voice.gain[1] = voice.gain[0];
}

void make_voices_here(const VoiceTable& table, int places, std::span<const std::uint32_t> slots,
                      Voice* voices, std::size_t first) {
  const VoiceArrivals& arrivals = table.arrivals;
  for (const std::uint32_t slot : slots) {
    Voice& voice = voices[slot - first];
    make_voice(table, static_cast<std::size_t>(places), slot, voice);
    for (std::size_t e = 0; e < kEars; ++e) voice.delay_frames[e] = arrivals.delay_frames[e][slot];
    voice.from = {arrivals.from[0][slot], arrivals.from[1][slot], arrivals.from[2][slot]};
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(place_voices_here);
HWY_EXPORT(make_voices_here);
}  // namespace

void place_voices(VoiceTable& table, const ListenerFrame& listener, const ItdTable* itd_table,
                  std::size_t first, std::size_t last, bool delays_only) {
  HWY_DYNAMIC_DISPATCH(place_voices_here)
  (table, listener, itd_table == nullptr ? nullptr : itd_table->table(), first, last, delays_only);
}

void make_voices(const VoiceTable& table, int places, std::span<const std::uint32_t> slots,
                 Voice* voices, std::size_t first) {
  HWY_DYNAMIC_DISPATCH(make_voices_here)(table, places, slots, voices, first);
}

ListenerFrame listener_frame(const Listener& listener, Receivers receivers) {
  const bool pair = receivers == Receivers::kPair;
  const Vec3 side_m = (pair ? 0.5 * kEarDistance_m : 0) * listener.right();
  return {listener.position_m, {listener.position_m - side_m, listener.position_m + side_m},
          listener.forward(),  -listener.right(),
          listener.up(),       pair ? kEars : 1};
}

double MovingSourcePoint::later_m(const Vec3& place) const {
  if (mach == Vec3f(0)) return 0;
  const Vec3 w = place - Vec3(position_m), m(mach);
  const double b = age_m - (w.x * m.x + w.y * m.y + w.z * m.z);
  const double rest = 1 - (m.x * m.x + m.y * m.y + m.z * m.z);
  const double under = b * b - rest * (age_m * age_m - (w.x * w.x + w.y * w.y + w.z * w.z));
  return (b - std::sqrt(std::max(under, 0.0))) / rest;
}

double delay_frames(const VoiceTable& table, const ListenerFrame& listener,
                    const ItdTable* itd_table, const MovingSourcePoint& source,
                    double emission_frames, int ear) {
  const Vec3 place_m = listener.places == 1 ? listener.centre_m : listener.ear_positions_m[ear];
  const Vec3 moved_m = source.later_m(place_m) * Vec3(source.mach);
  const Vec3 path = place_m - Vec3(source.position_m) - moved_m;
  const double r_m = std::sqrt(path.x * path.x + path.y * path.y + path.z * path.z);
  const double frames = emission_frames + r_m * table.geometry.frames_per_m;
  if (itd_table == nullptr || listener.places > 1) return frames;
  const Vec3f from = direction_from(listener, Vec3f(Vec3(source.position_m) + moved_m));
  const double half_itd = 0.5 * static_cast<double>((*itd_table)(from));
  return ear == 0 ? frames - half_itd : frames + half_itd;
}

Vec3f direction_from(const ListenerFrame& listener, const Vec3f& position_m) {
  const Vec3 path = listener.centre_m - Vec3(position_m);
  const auto r_m =
      static_cast<float>(std::sqrt(path.x * path.x + path.y * path.y + path.z * path.z));
  if (r_m <= 1e-6f) return {1, 0, 0};
  const Vec3f towards(path);
  const float over_m = 1 / r_m;
  const auto along = [&](const Vec3& axis) {
    const Vec3f a(axis);
    return -((towards.x * a.x + towards.y * a.y + towards.z * a.z) * over_m);
  };
  return {along(listener.ahead), along(listener.left), along(listener.up)};
}

}  // namespace clamor

#endif  // HWY_ONCE
