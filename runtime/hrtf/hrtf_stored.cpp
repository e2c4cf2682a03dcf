// hrtf_stored.cpp: a fitted HRTF as bytes: a header, then little-endian floats: for each direction
// its place and its fit, and last the tables that all directions share.
#include <array>
#include <cstdint>
#include <cstring>

#include "runtime/hrtf/hrtf.h"

namespace clamor {

namespace {

struct Header {
  std::array<char, 8> magic{'c', 'l', 'm', 'r', 'h', 'e', 'a', 'd'};
  std::uint32_t version = 1;
  std::uint32_t directions = 0;

  bool operator==(const Header&) const = default;
};

template <class T>
std::span<float> floats_of(T& part) {
  static_assert(sizeof(part) % sizeof(float) == 0);
  return {reinterpret_cast<float*>(&part), sizeof(part) / sizeof(float)};
}

}  // namespace

template <class Act>
void Hrtf::for_each_part(Direction& direction, const Act& act) {
  act(floats_of(direction.octave));
  act(floats_of(direction.itd_frames));
  act(floats_of(direction.low_itd_frames));
  act(floats_of(direction.level));
  act(floats_of(direction.across));
  act(floats_of(direction.energies));
}

std::vector<std::byte> Hrtf::stored() const {
  std::vector<std::byte> bytes;
  const auto put = [&bytes](const void* from, std::size_t count) {
    bytes.resize(bytes.size() + count);
    std::memcpy(bytes.data() + bytes.size() - count, from, count);
  };
  Header header;
  header.directions = static_cast<std::uint32_t>(directions_.size());
  put(&header, sizeof header);
  for (std::size_t d = 0; d < directions_.size(); ++d) {
    put(&places_[d], sizeof places_[d]);
    Direction direction = directions_[d];
    for_each_part(direction,
                  [&](std::span<const float> floats) { put(floats.data(), floats.size_bytes()); });
  }
  put(&shares_, sizeof shares_);
  put(&parts_, sizeof parts_);
  return bytes;
}

std::shared_ptr<const Hrtf> Hrtf::from_stored(std::span<const std::byte> bytes) {
  const auto take = [&bytes](void* into, std::size_t count) {
    if (count > bytes.size()) return false;
    std::memcpy(into, bytes.data(), count);
    bytes = bytes.subspan(count);
    return true;
  };
  Header header;
  Header expected;
  if (!take(&header, sizeof header)) return nullptr;
  expected.directions = header.directions;
  if (header != expected || header.directions > bytes.size() / sizeof(float)) return nullptr;
  const std::shared_ptr<Hrtf> head(new Hrtf);
  head->directions_.resize(header.directions);
  head->places_.resize(header.directions);
  bool is_whole = true;
  for (std::size_t d = 0; d < head->directions_.size(); ++d) {
    is_whole = is_whole && take(&head->places_[d], sizeof head->places_[d]);
    for_each_part(head->directions_[d], [&](std::span<float> floats) {
      is_whole = is_whole && take(floats.data(), floats.size_bytes());
    });
  }
  is_whole = is_whole && take(&head->shares_, sizeof head->shares_) &&
             take(&head->parts_, sizeof head->parts_) && bytes.empty();
  if (!is_whole) return nullptr;
  head->mesh_ = std::make_unique<const DirectionMesh>(head->places_);
  return head;
}

}  // namespace clamor
