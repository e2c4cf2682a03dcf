#!/usr/bin/env bash
# Highway 1.0.3: DemoteTo float16_t rounds to nearest for AVX2, and cuts the same numbers off for SSE4.
#
# Highway promises portable vectors, and its conversions between integers give the same on every target. That to half
# precision is one instruction where processors have F16C, which rounds to the nearest number; elsewhere (SSE4, but also
# WebAssembly) it is emulated by shifts that drop the bits: 1 + 1.75/1024 becomes 1 + 2/1024 or 1 + 1/1024. So what is
# stored in half precision depends on the processor that wrote it, by one step in half of all numbers, and the cut ones
# are too small by half a step in the mean.
#
# It concerns who keeps spectra, meshes, colours or weights in half precision and compares or ships them. Round the 13
# last bits of the float away before the conversion: then both give the same.
# Clamor rounds the spectra of its field so, and a test runs on every instruction set.
set -euo pipefail
grep -qw f16c /proc/cpuinfo && command -v g++ >/dev/null || { echo "needs a processor with F16C, and g++"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libhwy-dev=1.0.3-3+deb12u1 libhwy1=1.0.3-3+deb12u1; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done

cat >half.cpp <<'EOF'
#include <cstdint>
#include <cstdio>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
// Thousandths of the last step of half precision above 1 that a number keeps.
int kept(float number) {
  const hn::CappedTag<float, 4> d;
  const hn::Rebind<hwy::float16_t, decltype(d)> half;
  const auto back = hn::PromoteTo(d, hn::DemoteTo(half, hn::Set(d, number)));
  return static_cast<int>((hn::GetLane(back) - 1) * 1024 * 1000);
}
}  // namespace HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

int main() {
  for (const float steps : {0.25f, 1.25f, 1.75f, 2.75f})
    std::printf(" %.2f:%d", steps, HWY_STATIC_DISPATCH(kept)(1 + steps / 1024) / 1000);
  std::puts("");
}
EOF
for flags in "-mssse3 -msse4.1 -msse4.2 -maes -mpclmul" "-march=haswell -maes"; do
  g++ -std=c++17 -O2 $flags -DHWY_COMPILE_ONLY_STATIC -isystem usr/include half.cpp -o half
  echo "${flags%% *}:$(./half)"
done >seen.txt
cat seen.txt
diff seen.txt - <<'EOF' && echo "as described: the same numbers are cut for SSE4 and rounded for AVX2"
-mssse3: 0.25:0 1.25:1 1.75:1 2.75:2
-march=haswell: 0.25:0 1.25:1 1.75:2 2.75:3
EOF
