// clamor_sequences_test.cpp: random sequences of calls of the C interface (call_sequence.h), the
// same in every run. CLAMOR_CALLS=10000000 makes as many calls.
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/library/call_sequence.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

std::uint64_t wanted_calls() {
  const char* const calls = std::getenv("CLAMOR_CALLS");
  if (calls != nullptr) return std::strtoull(calls, nullptr, 10);
  return testing::kSanitized ? 6000 : 20'000;
}

// Every broken promise aborts. Sanitizers look for bad accesses and leaks meanwhile.
TEST(ClamorSequences, KeepTheirPromisesWhateverIsCalled) {
  std::mt19937 random(1);
  const std::uint64_t wanted = wanted_calls();
  std::uint64_t calls = 0, sequences = 0;
  while (calls < wanted) {
    std::vector<std::uint8_t> bytes(16 + random() % 800);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    calls += testing::make_call_sequence(bytes);
    ++sequences;
  }
  RecordProperty("calls", std::to_string(calls));
  RecordProperty("sequences", std::to_string(sequences));
}

}  // namespace
}  // namespace clamor
