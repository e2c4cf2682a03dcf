// root_fuzz.cpp: the root of a bake file, a Cap'n Proto message, without its checksum.
#include <cstring>
#include <vector>

#include "formats/bake_file/bake_root_reader.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 8) return 0;
  std::vector<std::uint64_t> words(size / 8);  // aligned for the reader
  std::memcpy(words.data(), data, 8 * words.size());
  const auto root = read_bake_root(std::as_bytes(std::span(words)), 1 << 20);
  if (!root.ok() && root.error().message.empty()) std::abort();
  if (!root.ok()) return 0;
  for (const Emitter& emitter : root->emitters)
    if (emitter.signal >= root->signals.size()) std::abort();
  for (const auto& map : root->signal_maps)
    for (const std::uint32_t signal : map)
      if (signal >= root->signals.size()) std::abort();
  for (const StoredProbe& probe : root->probes.places)
    if (probe.zone >= root->probes.zones.size() || !is_finite(probe.position_m)) std::abort();
  if (root->depths.size() != root->trees.size()) std::abort();
  return 0;
}
