// forged_root.h: bake files with a modified root and valid checksums.
#pragma once

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

}  // namespace clamor::testing
