// page_kernel.cpp: decodes a page, compiled once per instruction set.
//
// All input is untrusted: every count is compared with that of the node and every value with its
// limits, for whole columns at once where that needs no branch per source. Arithmetic wraps.
// Results are bit-exact for all instruction sets (common/maths.h).
#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/page_layout.h"
#include "formats/bake_file/page_workspace.h"
#include "formats/bake_file/source_quantization.h"

// Highway compiles the following once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "formats/bake_file/page_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "formats/bake_file/page_columns-inl.h"
#include "formats/bake_file/page_output-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

const char* read_header(PageWorkspace& w, const NodeSummary& node) {
  w.rows.count = w.bits.get(kCountBits);
  w.emitters.count = w.bits.get(kCountBits);
  w.planes.count = w.bits.get(kCountBits);
  w.header.flags = w.bits.get(kFlagBits);
  w.header.mirror_bits = kMinMirrorBits + static_cast<int>(w.bits.get(3));
  w.header.max_power = kMinPower_half_db + static_cast<std::int32_t>(w.bits.get(kPowerBits));
  w.header.silent_step = static_cast<std::int32_t>(w.bits.get(kPowerBits));
  if (!w.bits.ok() || node.source_count > kLeafSources ||
      w.rows.count + w.emitters.count != node.source_count)
    return "holds another number of sources than its node";
  if (w.planes.count > w.rows.count || (w.planes.count == 0) != (w.rows.count == 0))
    return "holds another number of planes than its sources lie on";
  if (w.header.mirror_bits > kMaxMirrorBits) return "has directions with too many bits";
  if (w.header.max_power > kMaxPower_half_db ||
      w.header.max_power - w.header.silent_step + 1 < kMinPower_half_db)
    return "has a power out of range";
  return nullptr;
}

const char* read_planes(PageWorkspace& w, std::size_t materials) {
  Numbers &normal_a = w.column[0], &normal_b = w.column[1], &material = w.column[2];
  for (Numbers* numbers : {&normal_a, &normal_b, &material, &w.planes.extra_rows, &w.planes.first_u,
                           &w.planes.first_w})
    read_column(w, numbers->data(), w.planes.count);
  if (!w.bits.ok()) return "ends too early";
  for (std::size_t i = 1; i < w.planes.count; ++i) normal_a[i] = sum(normal_a[i], normal_a[i - 1]);
  constexpr std::int32_t kMost = (1 << kNormalBits) - 2;
  if (!all_in_range(normal_a, w.planes.count, 0, kMost) ||
      !all_in_range(normal_b, w.planes.count, 0, kMost))
    return "has a direction out of range";
  if (!all_in_range(material, w.planes.count, 0, static_cast<std::int32_t>(materials) - 1))
    return "names a material that does not exist";
  if (!all_in_range(w.planes.extra_rows, w.planes.count, 0,
                    static_cast<std::int32_t>(w.rows.count) - 1))
    return "does not partition its sources among planes";

  std::int32_t shared_out = static_cast<std::int32_t>(w.planes.count);
  for (std::size_t i = 0; i < w.planes.count; ++i) shared_out += w.planes.extra_rows[i];
  if (shared_out != static_cast<std::int32_t>(w.rows.count))
    return "does not partition its sources among planes";

  std::array<float*, 3> normal{w.planes.normal[0].data(), w.planes.normal[1].data(),
                               w.planes.normal[2].data()};
  for (std::size_t i = 0; i < w.planes.count; ++i)
    direction_of(normal_a[i], normal_b[i], direction_scale(kNormalBits), normal[0][i], normal[1][i],
                 normal[2][i]);
  std::fill_n(w.rows.begins_plane.data(), w.rows.count, std::uint8_t{0});
  std::size_t row = 0;
  for (std::size_t i = 0; i < w.planes.count; ++i) {
    w.planes.record[i] = {normal[0][i], normal[1][i], normal[2][i],
                          std::bit_cast<float>(material[i])};
    w.rows.begins_plane[row] = 1;
    row += static_cast<std::size_t>(w.planes.extra_rows[i]) + 1;
  }
  return nullptr;
}

// Computes axes, slopes and origin of every plane, without branches.
void place_planes(PageWorkspace& w, const GridBox& box, const std::int32_t* from_v) {
  const std::array<const float*, 3> n{w.planes.normal[0].data(), w.planes.normal[1].data(),
                                      w.planes.normal[2].data()};
  for (std::size_t i = 0; i < w.planes.count; ++i) {
    const std::int32_t axis = dominant_axis(n[0][i], n[1][i], n[2][i]);
    const float along_w = axis == 0 ? n[0][i] : axis == 1 ? n[1][i] : n[2][i];
    const float along_u = axis == 0 ? n[1][i] : axis == 1 ? n[2][i] : n[0][i];
    const float along_v = axis == 0 ? n[2][i] : axis == 1 ? n[0][i] : n[1][i];
    w.planes.dominant_axis[i] = axis;
    w.planes.slope_u[i] = slope_of(along_u, along_w);
    w.planes.slope_v[i] = slope_of(along_v, along_w);
  }
  constexpr std::array<std::uint32_t, 5> kCycle{0, 1, 2, 0, 1};
  std::size_t row = 0;
  for (std::size_t i = 0; i < w.planes.count; ++i) {
    const auto axis = static_cast<std::size_t>(w.planes.dominant_axis[i]);
    w.planes.origin[i] = {kCycle[axis + 1],    kCycle[axis + 2],
                          kCycle[axis],        w.planes.slope_u[i],
                          w.planes.slope_v[i], sum(w.planes.first_u[i], box.low[kCycle[axis + 1]]),
                          from_v[row],         sum(w.planes.first_w[i], box.low[axis])};
    row += static_cast<std::size_t>(w.planes.extra_rows[i]) + 1;
  }
}

// Iterates over rows instead of planes: a plane may have a single source or a thousand, and the end
// of an inner loop would be mispredicted.
const char* read_positions(PageWorkspace& w, const NodeSummary& node) {
  // The first source of a plane has no step and no residual; element 0 stands in for them.
  w.column[0][0] = w.column[2][0] = 0;
  read_column(w, w.column[0].data() + 1, w.rows.count - w.planes.count);
  read_column(w, w.column[1].data(), w.rows.count);
  read_column(w, w.column[2].data() + 1, w.rows.count - w.planes.count);
  if (!w.bits.ok()) return "ends too early";
  const GridBox box = grid_box_of(node);
  const std::int32_t *step_u = w.column[0].data(), *from_v = w.column[1].data(),
                     *rest_w = w.column[2].data();
  place_planes(w, box, from_v);
  const std::array<std::int32_t*, 3> position{w.rows.position[0].data(), w.rows.position[1].data(),
                                              w.rows.position[2].data()};
  std::size_t plane = ~std::size_t{0};
  std::int32_t u = 0;  // relative to the first source of the plane
  for (std::size_t row = 0; row < w.rows.count; ++row) {
    const std::int32_t first = w.rows.begins_plane[row], not_first = first - 1;
    plane += static_cast<std::size_t>(first);
    const PageWorkspace::PlaneOrigin& on = w.planes.origin[plane];
    u = sum(u, step_u[row - plane]) & not_first;
    const std::int32_t v = difference(from_v[row], on.first_v);
    const std::int64_t rise = std::int64_t{on.slope_u} * u + std::int64_t{on.slope_v} * v + 32768;
    w.rows.plane[row] = static_cast<Place>(plane);
    position[on.axis_u][row] = sum(on.first_u, u);
    position[on.axis_v][row] = sum(from_v[row], box.low[on.axis_v]);
    position[on.axis_w][row] = sum(sum(on.first_w, rest_w[row - plane] & not_first),
                                   static_cast<std::int32_t>(rise >> 16));
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!all_in_range(w.rows.position[axis], w.rows.count, box.low[axis], box.high[axis]))
      return "has a source outside its node";
  return nullptr;
}

const char* read_powers(PageWorkspace& w, const PageTables& tables) {
  if (w.rows.count == 0) return nullptr;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::int32_t weight_one = b >= 1 ? w.bits.get_signed(kWeightBits) : 0;
    const std::int32_t weight_two = b >= 2 ? w.bits.get_signed(kWeightBits) : 0;
    std::int32_t* const band = w.rows.steps[b].data();
    read_column(w, band, w.rows.count);
    if (b >= 1) {
      const std::int32_t* const one = w.rows.steps[b - 1].data();
      const std::int32_t* const two = w.rows.steps[b >= 2 ? b - 2 : 0].data();
      for (std::size_t i = 0; i < w.rows.count; ++i)
        band[i] = sum(band[i], predicted(one[i], two[i], weight_one, weight_two));
    }
    if (!all_in_range(w.rows.steps[b], w.rows.count, 0, w.header.silent_step))
      return "has a power out of range";
  }
  read_column(w, w.rows.radius.data(), w.rows.count);
  if (!w.bits.ok()) return "ends too early";

  Numbers& loudest = w.scratch;
  std::copy_n(w.rows.steps[0].begin(), w.rows.count, loudest.begin());
  for (std::size_t b = 1; b < kBandCount; ++b)
    for (std::size_t i = 0; i < w.rows.count; ++i)
      loudest[i] = std::min(loudest[i], w.rows.steps[b][i]);
  for (std::size_t i = 0; i < w.rows.count; ++i)
    w.rows.radius[i] = sum(w.rows.radius[i], -loudest[i]);
  if (!all_in_range(w.rows.radius, w.rows.count, 0, kRadiusCodes - 1))
    return "has a patch radius out of range";

  std::array<float, kMaxPower_half_db - kSilent_half_db + 1>
      power_at;  // indexed by steps below the maximum
  for (std::int32_t s = 0; s < w.header.silent_step; ++s)
    power_at[static_cast<std::size_t>(s)] = tables.power[w.header.max_power - s - kSilent_half_db];
  power_at[static_cast<std::size_t>(w.header.silent_step)] = 0;
  std::array<const std::int32_t*, kBandCount> steps;
  for (std::size_t b = 0; b < kBandCount; ++b) steps[b] = w.rows.steps[b].data();
  for (std::size_t i = 0; i < w.rows.count; ++i) {
    std::array<float, kBandCount>& power = w.rows.power[i];
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] = power_at[static_cast<std::size_t>(steps[b][i])];
    double sum_of_bands = 0;
    for (const float band : power) sum_of_bands += static_cast<double>(band);
    w.sorting.power_sum[i] = sum_of_bands;
  }
  return nullptr;
}

// Derives u and polarity of the secondary sources.
void derive_u_and_polarity(PageWorkspace& w) {
  const auto raw = [](std::int32_t value) { return static_cast<std::uint32_t>(value); };
  for (std::size_t i = 0; i < w.rows.count; ++i) {
    const std::uint32_t random = source_hash(
        w.rows.position[0][i], w.rows.position[1][i], w.rows.position[2][i], raw(w.rows.delay[i]),
        raw(w.rows.emitter[i]), raw(w.rows.mirror[0][i]) | raw(w.rows.mirror[1][i]) << 16);
    w.rows.u[i] = u_from_hash(random);
    w.rows.polarity[i] = polarity_from_hash(random);
  }
}

const char* read_rest(PageWorkspace& w, const PageTables& tables) {
  const std::span<const Emitter> emitters = tables.emitters;
  for (Numbers* numbers : {&w.rows.delay, &w.rows.mirror[0], &w.rows.mirror[1], &w.rows.emitter})
    read_column(w, numbers->data(), w.rows.count);
  const std::int32_t most = (1 << w.header.mirror_bits) - 2;
  if (!all_in_range(w.rows.mirror[0], w.rows.count, 0, most) ||
      !all_in_range(w.rows.mirror[1], w.rows.count, 0, most))
    return "has a direction out of range";
  derive_u_and_polarity(w);
  if ((w.header.flags & kStoresNumbers) != 0) {
    read_column(w, w.scratch.data(), w.rows.count);
    for (std::size_t i = 0; i < w.rows.count; ++i) w.rows.u[i] = std::bit_cast<float>(w.scratch[i]);
  }
  if ((w.header.flags & kStoresPolarity) != 0) {
    read_column(w, w.scratch.data(), w.rows.count);
    for (std::size_t i = 0; i < w.rows.count; ++i)
      w.rows.polarity[i] = (w.scratch[i] & 1) != 0 ? -1 : 1;
  }
  read_column(w, w.rows.emitter.data() + w.rows.count, w.emitters.count);
  read_column(w, w.scratch.data(), w.emitters.count);
  if (!w.bits.ok()) return "ends too early";

  const std::size_t count = w.rows.count + w.emitters.count;
  const std::size_t limit = tables.first_legs > 0 ? tables.first_legs : emitters.size();
  if (!all_in_range(w.rows.emitter, count, 0,
                    static_cast<std::int32_t>(std::min<std::size_t>(limit, 0x7fffffff)) - 1))
    return tables.first_legs > 0 ? "has a first leg out of range"
                                 : "names an emitter that does not exist";
  if (tables.first_legs > 0 && w.emitters.count > 0) return "has emitters in the tree of a probe";
  for (std::size_t i = 0; i < w.emitters.count; ++i) {
    const std::size_t row = w.rows.count + i;
    Source& source = w.emitters.sources[i];
    source.emitter = static_cast<std::uint32_t>(w.rows.emitter[row]);
    set_from_emitter(source, emitters[source.emitter]);
    source.u = w.rows.u[row] = std::bit_cast<float>(w.scratch[i]);
    w.sorting.power_sum[row] = 0;
    for (const float band : source.power) w.sorting.power_sum[row] += static_cast<double>(band);
  }
  std::int32_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i)
    wrong |= (w.rows.u[i] > 0 ? 0 : 1) | (w.rows.u[i] <= 1 ? 0 : 1);
  if (wrong != 0) return "has a u outside (0, 1]";
  return nullptr;
}

const char* decode_here(PageWorkspace& w, std::size_t bytes, const NodeSummary& node,
                        const PageTables& tables, PageColumns& columns) {
  w.bits = BitReader(std::span<const std::byte>(w.page).first(bytes));
  if (const char* const wrong = read_header(w, node)) return wrong;
  if (const char* const wrong = read_planes(w, tables.materials)) return wrong;
  if (const char* const wrong = read_positions(w, node)) return wrong;
  if (const char* const wrong = read_powers(w, tables)) return wrong;
  if (const char* const wrong = read_rest(w, tables)) return wrong;
  if (const char* const wrong = read_order(w)) return wrong;
  // Clears the rows of emitters, which the gathers over all rows read.
  for (Numbers* numbers : {&w.rows.position[0], &w.rows.position[1], &w.rows.position[2],
                           &w.rows.delay, &w.rows.radius, &w.rows.mirror[0], &w.rows.mirror[1]})
    std::fill_n(numbers->data() + w.rows.count, w.emitters.count, 0);
  for (std::size_t i = w.rows.count; i < w.rows.count + w.emitters.count; ++i)
    w.rows.power[i].fill(0);
  std::fill_n(w.rows.plane.data() + w.rows.count, w.emitters.count, Place{0});
  std::fill_n(w.rows.polarity.data() + w.rows.count, w.emitters.count, std::int8_t{1});
  if (w.planes.count == 0) w.planes.record[0] = {};
  put(w, tables, columns);
  return nullptr;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(decode_here);
}  // namespace

const char* decode_page_with(PageWorkspace& workspace, std::size_t bytes, const NodeSummary& node,
                             const PageTables& tables, PageColumns& columns) {
  return HWY_DYNAMIC_DISPATCH(decode_here)(workspace, bytes, node, tables, columns);
}

}  // namespace clamor

#endif  // HWY_ONCE
