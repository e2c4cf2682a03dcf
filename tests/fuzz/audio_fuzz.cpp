// audio_fuzz.cpp: sound files in any format of libsndfile.
#include "formats/audio/audio_file.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto samples = decode_audio(std::as_bytes(std::span(data, size)), "fuzzed");
  if (!samples.ok()) {
    if (samples.error().message.empty()) std::abort();
    return 0;
  }
  for (const float sample : *samples)
    if (!(sample > -1e9f && sample < 1e9f)) std::abort();
  return 0;
}
