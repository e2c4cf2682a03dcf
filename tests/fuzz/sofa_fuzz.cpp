// sofa_fuzz.cpp: HRTFs in SOFA files. libmysofa and libhdf5 run in a child process, and their output is
// validated; small HRTFs are also prepared for rendering.
#include <cmath>

#include "runtime/hrtf/hrtf.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

namespace {

void expect_finite(float number) {
  if (!std::isfinite(number)) std::abort();
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = fuzz::file_with(fuzz::text_of(data, size), ".sofa");
  const auto responses = read_sofa(path);
  if (!responses.ok()) {
    if (responses.error().message.empty()) std::abort();
    return 0;
  }
  for (const float sample : responses->samples) expect_finite(sample);
  constexpr std::size_t kFew = 40, kShort = 4096;  // 1 ms each
  if (responses->directions.size() > kFew || responses->frames > kShort) return 0;
  const auto head = Hrtf::read(path);
  if (!head.ok()) {
    if (head.error().message.empty()) std::abort();
    return 0;
  }
  for (const Vec3f& from : {Vec3f(1, 0, 0), Vec3f(0, -1, 0), Vec3f(0.6f, 0.48f, -0.64f)}) {
    for (const HrtfGains& ear : (*head)->gains(from))
      for (const float level : ear) expect_finite(level);
    expect_finite(static_cast<float>((*head)->delay_frames(from, 0)));
  }
  return 0;
}
