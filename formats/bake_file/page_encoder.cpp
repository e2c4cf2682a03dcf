// page_encoder.cpp: implementation of encode_page() (page.h).
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <tuple>

#include "formats/bake_file/bit_writer.h"
#include "formats/bake_file/page.h"
#include "formats/bake_file/page_layout.h"
#include "formats/level/emitter.h"

namespace clamor {

namespace {

using namespace page_layout;

using Numbers = std::vector<std::int32_t>;

constexpr int kSamePlane = 6;  // maximum height difference within a group, in steps

std::array<float, 3> normal_of(const QuantizedSource& code) {
  std::array<float, 3> normal{};
  direction_of(code.normal[0], code.normal[1], direction_scale(kNormalBits), normal[0], normal[1],
               normal[2]);
  return normal;
}

struct Row {
  QuantizedSource code;
  std::int32_t height = 0;  // of its plane at the lower corner of the bounds
  std::uint32_t place = 0;  // index in the node
};

struct Group {
  Plane plane;
  std::size_t first = 0, count = 0;
};

class PageEncoder {
 public:
  PageEncoder(const NodeSummary& node, std::span<const Source> sources, int mirror_bits)
      : sources_(sources), mirror_bits_(mirror_bits), box_(grid_box_of(node)) {}

  std::vector<std::byte> page();

 private:
  void sort_into_groups();
  void put_header();
  void put_groups();
  void put_positions();
  void put_powers();
  void put_band(const std::array<Numbers, kBandCount>& below, std::size_t band);
  void put_rest();
  bool order_can_be_found() const;
  void put_order();

  template <class Get>
  void put_rows(Get get) {
    Numbers numbers;
    for (const Row& row : rows_) numbers.push_back(static_cast<std::int32_t>(get(row)));
    bits_.put_column(numbers);
  }

  std::span<const Source> sources_;
  int mirror_bits_;
  GridBox box_;
  std::vector<Row> rows_;  // secondary sources, by group
  std::vector<Group> groups_;
  std::vector<std::uint32_t> emitters_;  // indices of emitters
  std::uint32_t flags_ = 0;
  std::int32_t top_ = kMinPower_half_db, silent_ = 0;
  BitWriter bits_;
};

void PageEncoder::sort_into_groups() {
  for (std::uint32_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].is_emitter) {
      emitters_.push_back(i);
      continue;
    }
    Row row{quantized(sources_[i], mirror_bits_), 0, i};
    const Plane plane = plane_of(normal_of(row.code));
    const auto from_low = [&](std::size_t axis) {
      return std::int64_t{row.code.position[axis]} - box_.low[axis];
    };
    row.height = row.code.position[plane.w] - plane.rise(from_low(plane.u), from_low(plane.v));
    rows_.push_back(row);
  }
  std::sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
    return std::tie(a.code.normal, a.code.material, a.height, a.place) <
           std::tie(b.code.normal, b.code.material, b.height, b.place);
  });
  for (std::size_t first = 0; first < rows_.size();) {
    const QuantizedSource& code = rows_[first].code;
    std::size_t last = first + 1;
    while (last < rows_.size() && rows_[last].code.normal == code.normal &&
           rows_[last].code.material == code.material &&
           std::int64_t{rows_[last].height} - rows_[first].height <= kSamePlane)
      ++last;
    const Plane plane = plane_of(normal_of(code));
    std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(first),
              rows_.begin() + static_cast<std::ptrdiff_t>(last),
              [&plane](const Row& a, const Row& b) {
                return std::tie(a.code.position[plane.u], a.place) <
                       std::tie(b.code.position[plane.u], b.place);
              });
    groups_.push_back({plane, first, last - first});
    first = last;
  }
}

// Returns whether a stable sort by descending key, as in the decoder, restores the order.
bool PageEncoder::order_can_be_found() const {
  std::vector<std::pair<float, std::uint32_t>> found;
  for (const Row& row : rows_) found.push_back({octree_key(sources_[row.place]), row.place});
  for (const std::uint32_t place : emitters_) found.push_back({octree_key(sources_[place]), place});
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  for (std::uint32_t i = 0; i < found.size(); ++i)
    if (found[i].second != i) return false;
  return true;
}

void PageEncoder::put_header() {
  std::int32_t lowest = kMaxPower_half_db;
  for (const Row& row : rows_) {
    const std::uint32_t random = source_hash(row.code);
    if (sources_[row.place].u != u_from_hash(random)) flags_ |= kStoresNumbers;
    if (sources_[row.place].polarity != polarity_from_hash(random)) flags_ |= kStoresPolarity;
    for (const std::int32_t power : row.code.power) {
      if (power == kSilent_half_db) continue;
      top_ = std::max(top_, power);
      lowest = std::min(lowest, power);
    }
  }
  if (!order_can_be_found()) flags_ |= kStoresOrder;
  silent_ = std::max(0, top_ - lowest + 1);
  bits_.put(static_cast<std::uint32_t>(rows_.size()), kCountBits);
  bits_.put(static_cast<std::uint32_t>(emitters_.size()), kCountBits);
  bits_.put(static_cast<std::uint32_t>(groups_.size()), kCountBits);
  bits_.put(flags_, kFlagBits);
  bits_.put(static_cast<std::uint32_t>(mirror_bits_ - kMinMirrorBits), 3);
  bits_.put(static_cast<std::uint32_t>(top_ - kMinPower_half_db), kPowerBits);
  bits_.put(static_cast<std::uint32_t>(silent_), kPowerBits);
}

void PageEncoder::put_groups() {
  Numbers normal_a, normal_b, material, more, first_u, first_w;
  for (const Group& group : groups_) {
    const QuantizedSource& code = rows_[group.first].code;
    const std::int32_t before =
        normal_a.empty() ? 0 : rows_[groups_[normal_a.size() - 1].first].code.normal[0];
    normal_a.push_back(code.normal[0] - before);
    normal_b.push_back(code.normal[1]);
    material.push_back(code.material);
    more.push_back(static_cast<std::int32_t>(group.count - 1));
    const Plane& plane = group.plane;
    first_u.push_back(code.position[plane.u] - box_.low[plane.u]);
    first_w.push_back(code.position[plane.w] - box_.low[plane.w]);
  }
  for (const Numbers* numbers : {&normal_a, &normal_b, &material, &more, &first_u, &first_w})
    bits_.put_column(*numbers);
}

void PageEncoder::put_positions() {
  Numbers u, v, w;
  for (const Group& group : groups_) {
    const Plane& plane = group.plane;
    const auto& first = rows_[group.first].code.position;
    for (std::size_t i = group.first; i < group.first + group.count; ++i) {
      const auto& position = rows_[i].code.position;
      v.push_back(position[plane.v] - box_.low[plane.v]);
      if (i == group.first) continue;
      u.push_back(position[plane.u] - rows_[i - 1].code.position[plane.u]);
      w.push_back(position[plane.w] - first[plane.w] -
                  plane.rise(std::int64_t{position[plane.u]} - first[plane.u],
                             std::int64_t{position[plane.v]} - first[plane.v]));
    }
  }
  for (const Numbers* numbers : {&u, &v, &w}) bits_.put_column(*numbers);
}

// Least-squares prediction weights of the two bands below, about the means.
std::array<std::int32_t, 2> best_weights(const Numbers& wanted, const Numbers& one,
                                         const Numbers* two) {
  const auto n = static_cast<double>(wanted.size());
  const auto mean = [n](const Numbers& numbers) {
    return std::accumulate(numbers.begin(), numbers.end(), 0.0) / n;
  };
  const double mean_y = mean(wanted), mean_1 = mean(one), mean_2 = two != nullptr ? mean(*two) : 0;
  double s11 = 1, s12 = 0, s22 = 1, s1y = 0, s2y = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double y = wanted[i] - mean_y, a = one[i] - mean_1;
    const double b = two != nullptr ? (*two)[i] - mean_2 : 0;
    s11 += a * a;
    s12 += a * b;
    s22 += b * b;
    s1y += a * y;
    s2y += b * y;
  }
  const double determinant = s11 * s22 - s12 * s12;
  if (!(determinant > 0)) return {0, 0};
  const auto weight = [](double value) {
    constexpr double kMost = (1 << (kWeightBits - 1)) - 1;
    return static_cast<std::int32_t>(std::lround(std::clamp(kWeightOne * value, -kMost, kMost)));
  };
  return {weight((s1y * s22 - s2y * s12) / determinant),
          weight((s2y * s11 - s1y * s12) / determinant)};
}

void PageEncoder::put_band(const std::array<Numbers, kBandCount>& steps, std::size_t band) {
  const Numbers& wanted = steps[band];
  if (band == 0) return bits_.put_column(wanted);
  const Numbers& one = steps[band - 1];
  const Numbers* const two = band >= 2 ? &steps[band - 2] : nullptr;
  std::vector<std::array<std::int32_t, 2>> candidates = {
      {0, 0}, {kWeightOne, 0}, best_weights(wanted, one, two)};
  if (two != nullptr) candidates.push_back({2 * kWeightOne, -kWeightOne});

  Numbers best;
  std::array<std::int32_t, 2> best_pair{};
  std::uint64_t best_bits = ~std::uint64_t{0};
  for (const auto& weights : candidates) {
    Numbers rest;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      rest.push_back(wanted[i] -
                     predicted(one[i], two != nullptr ? (*two)[i] : 0, weights[0], weights[1]));
    const std::uint64_t bits = column_bits(rest);
    if (bits >= best_bits) continue;
    best_bits = bits;
    best = std::move(rest);
    best_pair = weights;
  }
  bits_.put_signed(best_pair[0], kWeightBits);
  if (two != nullptr) bits_.put_signed(best_pair[1], kWeightBits);
  bits_.put_column(best);
}

void PageEncoder::put_powers() {
  std::array<Numbers, kBandCount> steps;  // below the maximum
  for (const Row& row : rows_)
    for (std::size_t b = 0; b < kBandCount; ++b)
      steps[b].push_back(row.code.power[b] == kSilent_half_db ? silent_ : top_ - row.code.power[b]);
  for (std::size_t b = 0; b < kBandCount; ++b) put_band(steps, b);
  // Patch size correlates with power, so the radius is stored relative to the loudest band.
  Numbers radius;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    std::int32_t loudest = silent_;
    for (const Numbers& band : steps) loudest = std::min(loudest, band[i]);
    radius.push_back(rows_[i].code.radius + loudest);
  }
  bits_.put_column(radius);
}

void PageEncoder::put_rest() {
  put_rows([](const Row& row) { return row.code.delay; });
  put_rows([](const Row& row) { return row.code.mirror[0]; });
  put_rows([](const Row& row) { return row.code.mirror[1]; });
  put_rows([](const Row& row) { return row.code.emitter; });
  if ((flags_ & kStoresNumbers) != 0)
    put_rows([&](const Row& row) { return std::bit_cast<std::int32_t>(sources_[row.place].u); });
  if ((flags_ & kStoresPolarity) != 0)
    put_rows([&](const Row& row) { return sources_[row.place].polarity < 0 ? 1 : 0; });

  Numbers emitter, u;
  for (const std::uint32_t place : emitters_) {
    emitter.push_back(static_cast<std::int32_t>(sources_[place].emitter));
    u.push_back(std::bit_cast<std::int32_t>(sources_[place].u));
  }
  bits_.put_column(emitter);
  bits_.put_column(u);
}

void PageEncoder::put_order() {
  if ((flags_ & kStoresOrder) == 0) return;
  Numbers places;
  for (const Row& row : rows_) places.push_back(static_cast<std::int32_t>(row.place));
  for (const std::uint32_t place : emitters_) places.push_back(static_cast<std::int32_t>(place));
  bits_.put_column(places);
}

std::vector<std::byte> PageEncoder::page() {
  sort_into_groups();
  put_header();
  if (!rows_.empty()) {
    put_groups();
    put_positions();
    put_powers();
  }
  put_rest();
  put_order();
  return bits_.take();
}

}  // namespace

std::vector<std::byte> encode_page(const NodeSummary& node, std::span<const Source> sources,
                                   int mirror_bits) {
  assert(sources.size() <= kLeafSources);
  return PageEncoder(node, sources, mirror_bits).page();
}

}  // namespace clamor
