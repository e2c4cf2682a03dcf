// forged_root.h: bake files with a modified root and valid checksums.
#pragma once

#include <cstring>
#include <functional>

#include <capnp/message.h>
#include <capnp/serialize.h>

#include "formats/bake_file/bake_root.capnp.h"
#include "tests/formats/bake_examples.h"

namespace clamor::testing {

// Returns the file with a modified root and updated checksums.
inline Bytes with_root(Bytes bytes, const std::function<void(BakeRoot::Builder)>& change) {
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof(preamble));
  std::vector<capnp::word> words(preamble.root_bytes / sizeof(capnp::word));
  std::memcpy(words.data(), bytes.data() + preamble.root_offset, preamble.root_bytes);
  capnp::FlatArrayMessageReader reader(kj::arrayPtr(words.data(), words.size()));
  capnp::MallocMessageBuilder message;
  message.setRoot(reader.getRoot<BakeRoot>());
  change(message.getRoot<BakeRoot>());
  const auto flat = capnp::messageToFlatArray(message);
  const auto chars = flat.asChars();
  bytes.resize(preamble.root_offset);
  bytes.append(chars.begin(), chars.size());
  seal(bytes);
  return bytes;
}

// Offsets in an entry (bake_format.md).
inline constexpr std::size_t kSourcesAt = 84, kPackedAt = 88, kOctantAt = 92, kChildrenAt = 93,
                             kInstancesAt = 94, kBelowAt = 96, kOffsetAt = 104, kHashAt = 112;

template <class T>
void set_in(kj::ArrayPtr<kj::byte> bytes, std::size_t at, T value) {
  std::memcpy(bytes.begin() + at, &value, sizeof(T));
}

template <class T>
std::function<void(BakeRoot::Builder)> top_with(std::size_t at, T value) {
  return [=](BakeRoot::Builder root) { set_in(root.getTrees()[0].getTop(), at, value); };
}

// Moves the sections behind the block of the only signal by some bytes.
inline void move_what_follows(BakeRoot::Builder root, std::uint64_t added) {
  auto signal = root.getSignals()[0];
  signal.setEnvelopeOffset(signal.getEnvelopeOffset() + added);
  auto geometry = root.getGeometry();
  geometry.setOffset(geometry.getOffset() + added);
  for (auto page : geometry.getPages()) page.setOffset(page.getOffset() + added);
}

// Replaces bytes before the root by `put` and moves the root.
inline Bytes with_bytes(Bytes bytes, std::uint64_t offset, std::uint64_t count, const Bytes& put) {
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof(preamble));
  bytes.replace(offset, count, put);
  preamble.root_offset += put.size() - count;
  const std::uint64_t padding = -preamble.root_offset % 8;
  bytes.insert(preamble.root_offset, padding, '\0');
  preamble.root_offset += padding;
  std::memcpy(bytes.data(), &preamble, sizeof(preamble));
  seal(bytes);
  return bytes;
}

}  // namespace clamor::testing
