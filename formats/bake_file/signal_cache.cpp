#include "formats/bake_file/signal_cache.h"

#include <array>
#include <span>
#include <utility>

#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/bake_file/signal_section.h"
#include "formats/level/signal.h"

namespace clamor {

namespace {

std::uint64_t content_hash(const Signal& signal) {
  const std::array<std::uint64_t, 3> parts = {hash_of(std::as_bytes(std::span(signal.samples))),
                                              signal.samples.size(), signal.loop ? 1u : 0u};
  return hash_of(std::as_bytes(std::span(parts)));
}

}  // namespace

Result<EncodedSignal> encode_signal(const Signal& signal) {
  EncodedSignal encoded;
  encoded.scale = signal_scale(signal);
  auto blocks = pack_signal_blocks(signal, encoded.scale);
  if (!blocks.ok()) return blocks.error().in("signal " + in_quotes(signal.name));
  encoded.blocks = std::move(*blocks);
  const SignalEnvelope envelope(signal);
  encoded.envelope = pack_envelope(envelope);
  encoded.mean_square = envelope.mean_square();
  return encoded;
}

Result<std::vector<std::shared_ptr<const EncodedSignal>>> SignalCache::encode(
    const std::vector<Signal>& signals) {
  std::vector<std::shared_ptr<const EncodedSignal>> result;
  decltype(encoded_) used;
  for (const Signal& signal : signals) {
    const std::uint64_t hash = content_hash(signal);
    auto& entry = used[hash];
    if (const auto known = encoded_.find(hash); entry == nullptr && known != encoded_.end())
      entry = known->second;
    if (entry == nullptr) {
      auto encoded = encode_signal(signal);
      if (!encoded.ok()) return encoded.error();
      entry = std::make_shared<const EncodedSignal>(std::move(*encoded));
    }
    result.push_back(entry);
  }
  encoded_ = std::move(used);
  return result;
}

}  // namespace clamor
