// page_output-inl.h: sorts the decoded sources of a page by key and writes them to columns.
// Internal to page_kernel.cpp, which compiles it once per instruction set; hence the unusual
// include guard.
#if defined(CLAMOR_FORMATS_PAGE_ORDER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_FORMATS_PAGE_ORDER_INL_H
#undef CLAMOR_FORMATS_PAGE_ORDER_INL_H
#else
#define CLAMOR_FORMATS_PAGE_ORDER_INL_H
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#include "formats/bake_file/page_columns-inl.h"
#include "formats/bake_file/page_layout.h"
#include "formats/bake_file/page_workspace.h"
#include "formats/bake_file/source_quantization.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Exclusive prefix sum in place. Writes up to the next multiple of eight elements.
HWY_INLINE void exclusive_prefix_sum(Place* HWY_RESTRICT numbers, std::size_t count) {
#if HWY_TARGET == HWY_SCALAR
  Place before = 0;
  for (std::size_t i = 0; i < count; ++i)
    before = static_cast<Place>(before + std::exchange(numbers[i], before));
#else
  const hn::Full128<Place> d;
  auto before = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += 8) {
    const auto own = hn::LoadU(d, numbers + i);
    auto sums = hn::Add(own, hn::ShiftLeftLanes<1>(d, own));
    sums = hn::Add(sums, hn::ShiftLeftLanes<2>(d, sums));
    sums = hn::Add(sums, hn::ShiftLeftLanes<4>(d, sums));
    sums = hn::Add(sums, before);
    hn::StoreU(hn::Sub(sums, own), d, numbers + i);
    before = hn::TableLookupBytes(sums, hn::Set(d, 0x0f0e));
  }
#endif
}

// Stable bucket sort by descending key, followed by an insertion sort. Non-negative floats sort
// like their bits, which are distributed evenly enough over the buckets.
void sort_by_key(PageWorkspace& w) {
  const std::size_t count = w.rows.count + w.emitters.count;
  std::uint32_t least = ~0u, most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto key = static_cast<float>(w.sorting.power_sum[i] / static_cast<double>(w.rows.u[i]));
    w.sorting.keys[i] = ~std::bit_cast<std::uint32_t>(key);
    least = std::min(least, w.sorting.keys[i]);
    most = std::max(most, w.sorting.keys[i]);
  }
  // With four buckets per source, the insertion sort moves one source in eight.
  const std::size_t slots = 4 * count;
  std::array<Place, 4 * kLeafSources + 8> starts;
  std::fill_n(starts.begin(), slots + 8, Place{0});
  const float slots_per_step =
      static_cast<float>(slots) / (static_cast<float>(most - least) + 1.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const auto slot = static_cast<std::int32_t>(
        static_cast<float>(static_cast<std::int32_t>(w.sorting.keys[i] - least)) * slots_per_step);
    w.sorting.buckets[i] = std::min(slot, static_cast<std::int32_t>(slots) - 1);
  }
  for (std::size_t i = 0; i < count; ++i) ++starts[static_cast<std::size_t>(w.sorting.buckets[i])];
  exclusive_prefix_sum(starts.data(), slots);
  for (std::size_t i = 0; i < count; ++i)
    w.sorting.entries[starts[static_cast<std::size_t>(w.sorting.buckets[i])]++] =
        std::uint64_t{w.sorting.keys[i]} << 16 | i;
  for (std::size_t i = 1; i < count; ++i) {
    const std::uint64_t entry = w.sorting.entries[i];
    std::size_t to = i;
    for (; to > 0 && w.sorting.entries[to - 1] > entry; --to)
      w.sorting.entries[to] = w.sorting.entries[to - 1];
    w.sorting.entries[to] = entry;
  }
  for (std::size_t i = 0; i < count; ++i)
    w.sorting.order[i] = static_cast<Place>(w.sorting.entries[i] & 0xffff);
}

const char* read_order(PageWorkspace& w) {
  if ((w.header.flags & kStoresOrder) == 0) {
    sort_by_key(w);
  } else {
    const std::size_t count = w.rows.count + w.emitters.count;
    read_column(w, w.scratch.data(), count);
    if (!w.bits.ok()) return "ends too early";
    constexpr Place kNobody = 0xffff;
    std::fill_n(w.sorting.order.begin(), count, kNobody);
    for (std::size_t i = 0; i < count; ++i) {
      const auto place = static_cast<std::uint32_t>(w.scratch[i]);
      if (place >= count || w.sorting.order[place] != kNobody)
        return "assigns two sources to one position in the order";
      w.sorting.order[place] = static_cast<Place>(i);
    }
  }
  return w.bits.at_end() ? nullptr : "has more bytes than its sources take";
}

// Transposes four rows of four numbers.
HWY_INLINE void turn(const std::array<const float*, 4>& rows, std::array<float*, 4> columns) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t c = 0; c < 4; ++c) columns[c][r] = rows[r][c];
#else
  const hn::Full128<float> d;
  const auto a = hn::LoadU(d, rows[0]), b = hn::LoadU(d, rows[1]), e = hn::LoadU(d, rows[2]),
             f = hn::LoadU(d, rows[3]);
  const auto low_ab = hn::InterleaveLower(d, a, b), low_ef = hn::InterleaveLower(d, e, f);
  const auto high_ab = hn::InterleaveUpper(d, a, b), high_ef = hn::InterleaveUpper(d, e, f);
  hn::StoreU(hn::ConcatLowerLower(d, low_ef, low_ab), d, columns[0]);
  hn::StoreU(hn::ConcatUpperUpper(d, low_ef, low_ab), d, columns[1]);
  hn::StoreU(hn::ConcatLowerLower(d, high_ef, high_ab), d, columns[2]);
  hn::StoreU(hn::ConcatUpperUpper(d, high_ef, high_ab), d, columns[3]);
#endif
}

// Moves attributes with several values per row in groups of four rows, because the store unit
// limits writes to one per cycle.
void write_powers_and_planes(PageWorkspace& w, std::size_t count, PageColumns& columns) {
  static_assert(kBandCount == 8 && kLeafSources % 4 == 0);
  for (std::size_t i = count; i % 4 != 0; ++i) w.sorting.order[i] = 0;
  alignas(64) PageColumns::Column<float> material;
  for (std::size_t i = 0; i < count; i += 4) {
    std::array<const float*, 4> power, upper, plane;
    for (std::size_t r = 0; r < 4; ++r) {
      const std::size_t row = w.sorting.order[i + r];
      power[r] = w.rows.power[row].data();
      upper[r] = power[r] + 4;
      plane[r] = w.planes.record[w.rows.plane[row]].data();
    }
    auto& to = columns.power;
    turn(power, {&to[0][i], &to[1][i], &to[2][i], &to[3][i]});
    turn(upper, {&to[4][i], &to[5][i], &to[6][i], &to[7][i]});
    turn(plane,
         {&columns.normal[0][i], &columns.normal[1][i], &columns.normal[2][i], &material[i]});
  }
  for (std::size_t i = 0; i < count; ++i)
    columns.material[i] = static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(material[i]));
}

void put(PageWorkspace& w, const PageTables& tables, PageColumns& columns) {
  const std::size_t count = w.rows.count + w.emitters.count;
  write_powers_and_planes(w, count, columns);
  columns.count = static_cast<std::uint32_t>(count);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < count; ++i)
      columns.position_m[axis][i] = position_m_of(w.rows.position[axis][w.sorting.order[i]]);
  const float scale = direction_scale(w.header.mirror_bits);
  PageColumns::Column<std::int32_t> a, b;
  for (std::size_t i = 0; i < count; ++i) {
    a[i] = w.rows.mirror[0][w.sorting.order[i]];
    b[i] = w.rows.mirror[1][w.sorting.order[i]];
  }
  for (std::size_t i = 0; i < count; ++i)
    direction_of(a[i], b[i], scale, columns.mirror[0][i], columns.mirror[1][i],
                 columns.mirror[2][i]);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t row = w.sorting.order[i];
    columns.delay_s[i] = delay_s_of(static_cast<std::uint32_t>(w.rows.delay[row]));
    columns.patch_radius_m[i] = tables.radius[w.rows.radius[row]];
    columns.u[i] = w.rows.u[row];
    columns.emitter[i] = static_cast<std::uint32_t>(w.rows.emitter[row]);
    columns.polarity[i] = w.rows.polarity[row];
    columns.is_emitter[i] = 0;
  }
  if (w.emitters.count == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (w.sorting.order[i] < w.rows.count) continue;
    const Source& source = w.emitters.sources[w.sorting.order[i] - w.rows.count];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int k = static_cast<int>(axis);
      columns.position_m[axis][i] = source.position_m[k];
      columns.normal[axis][i] = source.normal[k];
      columns.mirror[axis][i] = source.mirror[k];
    }
    for (std::size_t band = 0; band < kBandCount; ++band)
      columns.power[band][i] = source.power[band];
    columns.material[i] = 0;
    columns.polarity[i] = 1;
    columns.is_emitter[i] = 1;
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
