// page_kernel.cpp: how a page is decoded, compiled once for each instruction set.
//
// Nothing is believed: every count is held against the node's, every number against its bounds, and
// whole columns at once where that can be done without a branch per source. Arithmetic wraps. The
// results are the same bits whatever the instruction set (common/maths.h says why).
#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "formats/page_layout.h"
#include "formats/page_workspace.h"
#include "formats/source_code.h"

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "formats/page_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using namespace page_layout;

using Numbers = PageWorkspace::Numbers;
using Place = PageWorkspace::Place;

HWY_INLINE std::int32_t sum(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

HWY_INLINE std::int32_t difference(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
}

// Whether all of the first n are from least to most.
HWY_INLINE bool all_within(const Numbers& numbers, std::size_t n, std::int32_t least,
                           std::int32_t most) {
  std::int32_t low = 0x7fffffff, high = -0x7fffffff - 1;
  for (std::size_t i = 0; i < n; ++i) {
    low = numbers[i] < low ? numbers[i] : low;
    high = numbers[i] > high ? numbers[i] : high;
  }
  return low >= least && high <= most;
}

// Four numbers of k bits are within 16 bytes, and where in those depends on k and on the bit that
// the first of them starts with. Two fours on, that is the same again.
struct FourTable {
  static constexpr int kMostBits = 25;  // more may need five bytes
  struct Entry {
    alignas(16) std::array<std::uint8_t, 16> bytes;
    alignas(16) std::array<std::uint32_t, 4> shifts;
  };
  std::array<std::array<Entry, 8>, kMostBits + 1> entries{};
};

constexpr FourTable four_table() {
  FourTable table{};
  for (std::size_t k = 0; k < table.entries.size(); ++k)
    for (std::size_t start = 0; start < 8; ++start)
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t bit = start + i * k;
        table.entries[k][start].shifts[i] = static_cast<std::uint32_t>(bit % 8);
        for (std::size_t j = 0; j < 4; ++j)
          table.entries[k][start].bytes[4 * i + j] =
              static_cast<std::uint8_t>(bit / 8 + j < 16 ? bit / 8 + j : 0x80);
      }
  return table;
}

constexpr FourTable kFours = four_table();

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void unpack(const std::byte* bytes, std::size_t bit, int k, std::uint32_t base,
                       std::int32_t* values, std::size_t count) {
  BitReader::unpack_one_by_one(bytes, bit, k, base, values, count);
}
#else
HWY_INLINE void unpack(const std::byte* bytes, std::size_t bit, int k, std::uint32_t base,
                       std::int32_t* HWY_RESTRICT values, std::size_t count) {
  if (k > FourTable::kMostBits)
    return BitReader::unpack_one_by_one(bytes, bit, k, base, values, count);
  const hn::Full128<std::uint32_t> d;
  const hn::Full128<std::uint8_t> d8;
  const auto& by_start = kFours.entries[static_cast<std::size_t>(k)];
  const auto mask = hn::Set(d, (1u << k) - 1), bases = hn::Set(d, base);
  const auto four = [&](std::size_t at, const FourTable::Entry& entry, std::size_t i) {
    const auto raw = hn::LoadU(d8, reinterpret_cast<const std::uint8_t*>(bytes) + at / 8);
    const auto words =
        hn::BitCast(d, hn::TableLookupBytesOr0(raw, hn::Load(d8, entry.bytes.data())));
    const auto numbers = hn::And(hn::Shr(words, hn::Load(d, entry.shifts.data())), mask);
    hn::StoreU(hn::Add(numbers, bases), d, reinterpret_cast<std::uint32_t*>(values) + i);
  };
  const std::size_t step = 4 * static_cast<std::size_t>(k);
  const auto &even = by_start[bit % 8], &odd = by_start[(bit + step) % 8];
  // What is beyond the last is written as well: columns have room for it.
  for (std::size_t i = 0; i < count; i += 8, bit += 2 * step) {
    four(bit, even, i);
    if (i + 4 < count) four(bit + step, odd, i + 4);
  }
}
#endif

// Where the ones of each byte are.
constexpr auto kOnesOfByte = [] {
  std::array<std::array<std::uint8_t, 8>, 256> ones{};
  for (std::size_t byte = 0; byte < ones.size(); ++byte)
    for (std::size_t bit = 0, n = 0; bit < 8; ++bit)
      if ((byte >> bit & 1) != 0) ones[byte][n++] = static_cast<std::uint8_t>(bit);
  return ones;
}();

// Byte by byte and without a branch: eight places are written for each, and those that it does not
// have are written over by the next.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void find_ones(std::uint64_t word, std::uint32_t from, std::uint16_t* ones) {
  BitReader::find_ones_one_by_one(word, from, ones);
}
#else
HWY_INLINE void find_ones(std::uint64_t word, std::uint32_t from,
                          std::uint16_t* HWY_RESTRICT ones) {
  // How many ones there are in each byte, and then in it and those below.
  std::uint64_t counts = word - (word >> 1 & 0x5555'5555'5555'5555u);
  counts = (counts & 0x3333'3333'3333'3333u) + (counts >> 2 & 0x3333'3333'3333'3333u);
  counts = (counts + (counts >> 4) & 0x0f0f'0f0f'0f0f'0f0fu) * 0x0101'0101'0101'0101u;
  const hn::Full64<std::uint8_t> d8;
  const hn::Full128<std::uint16_t> d;
  const auto bits_of_byte = hn::Set(d, 8);
  auto first = hn::Set(d, static_cast<std::uint16_t>(from));
  counts <<= 8;
  for (int byte = 0; byte < 8; ++byte, word >>= 8, counts >>= 8) {
    const auto places = hn::PromoteTo(d, hn::LoadU(d8, kOnesOfByte[word & 255].data()));
    hn::StoreU(hn::Add(places, first), d, ones + (counts & 255));
    first = hn::Add(first, bits_of_byte);
  }
}
#endif

// Writes up to three more numbers than it is asked for.
HWY_NOINLINE void read_column(PageWorkspace& w, std::int32_t* numbers, std::size_t count) {
  w.bits.get_column(
      numbers, count, [](auto... arguments) { unpack(arguments...); },
      [](auto... arguments) { find_ones(arguments...); });
}

const char* read_header(PageWorkspace& w, const NodeSummary& node) {
  w.rows = w.bits.get(kCountBits);
  w.emitter_rows = w.bits.get(kCountBits);
  w.planes = w.bits.get(kCountBits);
  w.flags = w.bits.get(kFlagBits);
  w.mirror_bits = kLeastMirrorBits + static_cast<int>(w.bits.get(3));
  w.top = kLowestPower + static_cast<std::int32_t>(w.bits.get(kPowerBits));
  w.silent = static_cast<std::int32_t>(w.bits.get(kPowerBits));
  if (!w.bits.ok() || node.source_count > kLeafSources ||
      w.rows + w.emitter_rows != node.source_count)
    return "holds another number of sources than its node";
  if (w.planes > w.rows || (w.planes == 0) != (w.rows == 0))
    return "holds another number of planes than its sources lie on";
  if (w.mirror_bits > kMostMirrorBits) return "has directions finer than any";
  if (w.top > kHighestPower || w.top - w.silent + 1 < kLowestPower)
    return "has a power beyond all bounds";
  return nullptr;
}

const char* read_planes(PageWorkspace& w, std::size_t materials) {
  Numbers &normal_a = w.column[0], &normal_b = w.column[1], &material = w.column[2];
  for (Numbers* numbers : {&normal_a, &normal_b, &material, &w.more, &w.first_u, &w.first_w})
    read_column(w, numbers->data(), w.planes);
  if (!w.bits.ok()) return "ends too early";
  for (std::size_t i = 1; i < w.planes; ++i) normal_a[i] = sum(normal_a[i], normal_a[i - 1]);
  constexpr std::int32_t kMost = (1 << kNormalBits) - 2;
  if (!all_within(normal_a, w.planes, 0, kMost) || !all_within(normal_b, w.planes, 0, kMost))
    return "has a direction beyond all directions";
  if (!all_within(material, w.planes, 0, static_cast<std::int32_t>(materials) - 1))
    return "names a material that does not exist";
  if (!all_within(w.more, w.planes, 0, static_cast<std::int32_t>(w.rows) - 1))
    return "shares out its sources wrongly";

  std::int32_t shared_out = static_cast<std::int32_t>(w.planes);
  for (std::size_t i = 0; i < w.planes; ++i) shared_out += w.more[i];
  if (shared_out != static_cast<std::int32_t>(w.rows)) return "shares out its sources wrongly";

  std::array<float*, 3> normal{w.normal[0].data(), w.normal[1].data(), w.normal[2].data()};
  for (std::size_t i = 0; i < w.planes; ++i)
    direction_of(normal_a[i], normal_b[i], direction_scale(kNormalBits), normal[0][i], normal[1][i],
                 normal[2][i]);
  std::fill_n(w.begins_plane.data(), w.rows, std::uint8_t{0});
  std::size_t row = 0;
  for (std::size_t i = 0; i < w.planes; ++i) {
    w.plane[i] = {normal[0][i], normal[1][i], normal[2][i], std::bit_cast<float>(material[i])};
    w.begins_plane[row] = 1;
    row += static_cast<std::size_t>(w.more[i]) + 1;
  }
  return nullptr;
}

// How each plane lies. The columns of planes are as good as unpacked: no branch for any of them.
void place_planes(PageWorkspace& w, const GridBox& box, const std::int32_t* from_v) {
  const std::array<const float*, 3> n{w.normal[0].data(), w.normal[1].data(), w.normal[2].data()};
  for (std::size_t i = 0; i < w.planes; ++i) {
    const std::int32_t axis = longest_axis(n[0][i], n[1][i], n[2][i]);
    const float along_w = axis == 0 ? n[0][i] : axis == 1 ? n[1][i] : n[2][i];
    const float along_u = axis == 0 ? n[1][i] : axis == 1 ? n[2][i] : n[0][i];
    const float along_v = axis == 0 ? n[2][i] : axis == 1 ? n[0][i] : n[1][i];
    w.longest[i] = axis;
    w.slope_u[i] = slope_of(along_u, along_w);
    w.slope_v[i] = slope_of(along_v, along_w);
  }
  constexpr std::array<std::uint32_t, 5> kCycle{0, 1, 2, 0, 1};
  std::size_t row = 0;
  for (std::size_t i = 0; i < w.planes; ++i) {
    const auto axis = static_cast<std::size_t>(w.longest[i]);
    w.plane_place[i] = {kCycle[axis + 1], kCycle[axis + 2],
                        kCycle[axis],     w.slope_u[i],
                        w.slope_v[i],     sum(w.first_u[i], box.low[kCycle[axis + 1]]),
                        from_v[row],      sum(w.first_w[i], box.low[axis])};
    row += static_cast<std::size_t>(w.more[i]) + 1;
  }
}

// Planes may hold a single source or a thousand, so rows are taken one after the other, whatever
// plane they are on: a loop for each plane would end where no branch predictor expects it.
const char* read_positions(PageWorkspace& w, const NodeSummary& node) {
  // What a plane's first source has none of is read before the first, and left out.
  w.column[0][0] = w.column[2][0] = 0;
  read_column(w, w.column[0].data() + 1, w.rows - w.planes);
  read_column(w, w.column[1].data(), w.rows);
  read_column(w, w.column[2].data() + 1, w.rows - w.planes);
  if (!w.bits.ok()) return "ends too early";
  const GridBox box = grid_box_of(node);
  const std::int32_t *step_u = w.column[0].data(), *from_v = w.column[1].data(),
                     *rest_w = w.column[2].data();
  place_planes(w, box, from_v);
  const std::array<std::int32_t*, 3> position{w.position[0].data(), w.position[1].data(),
                                              w.position[2].data()};
  std::size_t plane = ~std::size_t{0};
  std::int32_t u = 0;  // from the plane's first
  for (std::size_t row = 0; row < w.rows; ++row) {
    const std::int32_t first = w.begins_plane[row], not_first = first - 1;
    plane += static_cast<std::size_t>(first);
    const PageWorkspace::PlanePlace& on = w.plane_place[plane];
    u = sum(u, step_u[row - plane]) & not_first;
    const std::int32_t v = difference(from_v[row], on.first_v);
    const std::int64_t rise = std::int64_t{on.slope_u} * u + std::int64_t{on.slope_v} * v + 32768;
    w.plane_of_row[row] = static_cast<Place>(plane);
    position[on.axis_u][row] = sum(on.first_u, u);
    position[on.axis_v][row] = sum(from_v[row], box.low[on.axis_v]);
    position[on.axis_w][row] = sum(sum(on.first_w, rest_w[row - plane] & not_first),
                                   static_cast<std::int32_t>(rise >> 16));
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!all_within(w.position[axis], w.rows, box.low[axis], box.high[axis]))
      return "has a source outside its node";
  return nullptr;
}

const char* read_powers(PageWorkspace& w, const PageTables& tables) {
  if (w.rows == 0) return nullptr;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::int32_t weight_one = b >= 1 ? w.bits.get_signed(kWeightBits) : 0;
    const std::int32_t weight_two = b >= 2 ? w.bits.get_signed(kWeightBits) : 0;
    std::int32_t* const band = w.steps[b].data();
    read_column(w, band, w.rows);
    if (b >= 1) {
      const std::int32_t* const one = w.steps[b - 1].data();
      const std::int32_t* const two = w.steps[b >= 2 ? b - 2 : 0].data();
      for (std::size_t i = 0; i < w.rows; ++i)
        band[i] = sum(band[i], predicted(one[i], two[i], weight_one, weight_two));
    }
    if (!all_within(w.steps[b], w.rows, 0, w.silent)) return "has a power beyond all bounds";
  }
  read_column(w, w.radius.data(), w.rows);
  if (!w.bits.ok()) return "ends too early";

  Numbers& loudest = w.scratch;
  std::copy_n(w.steps[0].begin(), w.rows, loudest.begin());
  for (std::size_t b = 1; b < kBandCount; ++b)
    for (std::size_t i = 0; i < w.rows; ++i) loudest[i] = std::min(loudest[i], w.steps[b][i]);
  for (std::size_t i = 0; i < w.rows; ++i) w.radius[i] = sum(w.radius[i], -loudest[i]);
  if (!all_within(w.radius, w.rows, 0, kRadiusCodes - 1)) return "has a patch without bounds";

  std::array<float, kHighestPower - kSilent + 1> power_at;  // by steps below the top
  for (std::int32_t s = 0; s < w.silent; ++s)
    power_at[static_cast<std::size_t>(s)] = tables.power[w.top - s - kSilent];
  power_at[static_cast<std::size_t>(w.silent)] = 0;
  std::array<const std::int32_t*, kBandCount> steps;
  for (std::size_t b = 0; b < kBandCount; ++b) steps[b] = w.steps[b].data();
  for (std::size_t i = 0; i < w.rows; ++i) {
    std::array<float, kBandCount>& power = w.power[i];
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] = power_at[static_cast<std::size_t>(steps[b][i])];
    double sum_of_bands = 0;
    for (const float band : power) sum_of_bands += static_cast<double>(band);
    w.power_sum[i] = sum_of_bands;
  }
  return nullptr;
}

// u, polarity and key of the secondary sources.
void draw_numbers(PageWorkspace& w) {
  const auto raw = [](std::int32_t value) { return static_cast<std::uint32_t>(value); };
  for (std::size_t i = 0; i < w.rows; ++i) {
    const std::uint32_t random =
        random_of(w.position[0][i], w.position[1][i], w.position[2][i], raw(w.delay[i]),
                  raw(w.emitter[i]), raw(w.mirror[0][i]) | raw(w.mirror[1][i]) << 16);
    w.number[i] = permanent_number(random);
    w.sign[i] = polarity_of(random);
  }
}

const char* read_rest(PageWorkspace& w, std::span<const Emitter> emitters) {
  for (Numbers* numbers : {&w.delay, &w.mirror[0], &w.mirror[1], &w.emitter})
    read_column(w, numbers->data(), w.rows);
  const std::int32_t most = (1 << w.mirror_bits) - 2;
  if (!all_within(w.mirror[0], w.rows, 0, most) || !all_within(w.mirror[1], w.rows, 0, most))
    return "has a direction beyond all directions";
  draw_numbers(w);
  if ((w.flags & kStoresNumbers) != 0) {
    read_column(w, w.scratch.data(), w.rows);
    for (std::size_t i = 0; i < w.rows; ++i) w.number[i] = std::bit_cast<float>(w.scratch[i]);
  }
  if ((w.flags & kStoresPolarity) != 0) {
    read_column(w, w.scratch.data(), w.rows);
    for (std::size_t i = 0; i < w.rows; ++i) w.sign[i] = (w.scratch[i] & 1) != 0 ? -1 : 1;
  }
  read_column(w, w.emitter.data() + w.rows, w.emitter_rows);
  read_column(w, w.scratch.data(), w.emitter_rows);
  if (!w.bits.ok()) return "ends too early";

  const std::size_t count = w.rows + w.emitter_rows;
  if (!all_within(
          w.emitter, count, 0,
          static_cast<std::int32_t>(std::min<std::size_t>(emitters.size(), 0x7fffffff)) - 1))
    return "names an emitter that does not exist";
  for (std::size_t i = 0; i < w.emitter_rows; ++i) {
    const std::size_t row = w.rows + i;
    Source& source = w.emitter_sources[i];
    source.emitter = static_cast<std::uint32_t>(w.emitter[row]);
    set_from_emitter(source, emitters[source.emitter]);
    source.u = w.number[row] = std::bit_cast<float>(w.scratch[i]);
    w.power_sum[row] = 0;
    for (const float band : source.power) w.power_sum[row] += static_cast<double>(band);
  }
  std::int32_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i)
    wrong |= (w.number[i] > 0 ? 0 : 1) | (w.number[i] <= 1 ? 0 : 1);
  if (wrong != 0) return "has a permanent number outside (0, 1]";
  return nullptr;
}

// Each becomes the sum of those before it. The last of `numbers` may be written too, up to a
// multiple of eight.
HWY_INLINE void sum_of_those_before(Place* HWY_RESTRICT numbers, std::size_t count) {
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

// Highest first; of equals the first first. Floats that are not negative sort as their bits do, and
// their bits are spread evenly enough to put each almost where it belongs at once.
void sort_by_key(PageWorkspace& w) {
  const std::size_t count = w.rows + w.emitter_rows;
  std::uint32_t least = ~0u, most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto key = static_cast<float>(w.power_sum[i] / static_cast<double>(w.number[i]));
    w.keys[i] = ~std::bit_cast<std::uint32_t>(key);
    least = std::min(least, w.keys[i]);
    most = std::max(most, w.keys[i]);
  }
  // With four slots for each, one in eight has to be moved past another in the end.
  const std::size_t slots = 4 * count;
  std::array<Place, 4 * kLeafSources + 8> starts;
  std::fill_n(starts.begin(), slots + 8, Place{0});
  const float slots_per_step =
      static_cast<float>(slots) / (static_cast<float>(most - least) + 1.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const auto slot = static_cast<std::int32_t>(
        static_cast<float>(static_cast<std::int32_t>(w.keys[i] - least)) * slots_per_step);
    w.slots[i] = std::min(slot, static_cast<std::int32_t>(slots) - 1);
  }
  for (std::size_t i = 0; i < count; ++i) ++starts[static_cast<std::size_t>(w.slots[i])];
  sum_of_those_before(starts.data(), slots);
  for (std::size_t i = 0; i < count; ++i)
    w.entries[starts[static_cast<std::size_t>(w.slots[i])]++] = std::uint64_t{w.keys[i]} << 16 | i;
  for (std::size_t i = 1; i < count; ++i) {
    const std::uint64_t entry = w.entries[i];
    std::size_t to = i;
    for (; to > 0 && w.entries[to - 1] > entry; --to) w.entries[to] = w.entries[to - 1];
    w.entries[to] = entry;
  }
  for (std::size_t i = 0; i < count; ++i) w.order[i] = static_cast<Place>(w.entries[i] & 0xffff);
}

const char* read_order(PageWorkspace& w) {
  if ((w.flags & kStoresOrder) == 0) {
    sort_by_key(w);
  } else {
    const std::size_t count = w.rows + w.emitter_rows;
    read_column(w, w.scratch.data(), count);
    if (!w.bits.ok()) return "ends too early";
    constexpr Place kNobody = 0xffff;
    std::fill_n(w.order.begin(), count, kNobody);
    for (std::size_t i = 0; i < count; ++i) {
      const auto place = static_cast<std::uint32_t>(w.scratch[i]);
      if (place >= count || w.order[place] != kNobody) return "puts two sources in one place";
      w.order[place] = static_cast<Place>(i);
    }
  }
  return w.bits.at_end() ? nullptr : "has more bytes than its sources take";
}

// Four rows of four numbers become four columns of four.
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

// What is many numbers of a row is moved in fours: the columns take a store each, and no more than
// one fits into a cycle.
void put_powers_and_planes(PageWorkspace& w, std::size_t count, PageColumns& columns) {
  static_assert(kBandCount == 8 && kLeafSources % 4 == 0);
  for (std::size_t i = count; i % 4 != 0; ++i) w.order[i] = 0;
  alignas(64) PageColumns::Column<float> material;
  for (std::size_t i = 0; i < count; i += 4) {
    std::array<const float*, 4> power, upper, plane;
    for (std::size_t r = 0; r < 4; ++r) {
      const std::size_t row = w.order[i + r];
      power[r] = w.power[row].data();
      upper[r] = power[r] + 4;
      plane[r] = w.plane[w.plane_of_row[row]].data();
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
  const std::size_t count = w.rows + w.emitter_rows;
  put_powers_and_planes(w, count, columns);
  columns.count = static_cast<std::uint32_t>(count);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < count; ++i)
      columns.position_m[axis][i] = position_m_of(w.position[axis][w.order[i]]);
  const float scale = direction_scale(w.mirror_bits);
  PageColumns::Column<std::int32_t> a, b;
  for (std::size_t i = 0; i < count; ++i) {
    a[i] = w.mirror[0][w.order[i]];
    b[i] = w.mirror[1][w.order[i]];
  }
  for (std::size_t i = 0; i < count; ++i)
    direction_of(a[i], b[i], scale, columns.mirror[0][i], columns.mirror[1][i],
                 columns.mirror[2][i]);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t row = w.order[i];
    columns.delay_s[i] = delay_s_of(static_cast<std::uint32_t>(w.delay[row]));
    columns.patch_radius_m[i] = tables.radius[w.radius[row]];
    columns.u[i] = w.number[row];
    columns.emitter[i] = static_cast<std::uint32_t>(w.emitter[row]);
    columns.polarity[i] = w.sign[row];
    columns.is_emitter[i] = 0;
  }
  if (w.emitter_rows == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (w.order[i] < w.rows) continue;
    const Source& source = w.emitter_sources[w.order[i] - w.rows];
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

const char* decode_here(PageWorkspace& w, std::size_t bytes, const NodeSummary& node,
                        const PageTables& tables, PageColumns& columns) {
  w.bits = BitReader(std::span<const std::byte>(w.page).first(bytes));
  if (const char* const wrong = read_header(w, node)) return wrong;
  if (const char* const wrong = read_planes(w, tables.materials)) return wrong;
  if (const char* const wrong = read_positions(w, node)) return wrong;
  if (const char* const wrong = read_powers(w, tables)) return wrong;
  if (const char* const wrong = read_rest(w, tables.emitters)) return wrong;
  if (const char* const wrong = read_order(w)) return wrong;
  // What gathers over all rows finds of the emitters.
  for (Numbers* numbers : {&w.position[0], &w.position[1], &w.position[2], &w.delay, &w.radius,
                           &w.mirror[0], &w.mirror[1]})
    std::fill_n(numbers->data() + w.rows, w.emitter_rows, 0);
  for (std::size_t i = w.rows; i < w.rows + w.emitter_rows; ++i) w.power[i].fill(0);
  std::fill_n(w.plane_of_row.data() + w.rows, w.emitter_rows, Place{0});
  std::fill_n(w.sign.data() + w.rows, w.emitter_rows, std::int8_t{1});
  if (w.planes == 0) w.plane[0] = {};
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
