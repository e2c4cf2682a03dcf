#!/usr/bin/env bash
# libspatialaudio 0.3.0: turning AmbiX by nothing negates channel 5, and makes channel 12 louder by 11 dB.
#
# CAmbisonicProcessor turns a scene by yaw, pitch and roll. About the vertical, the two channels of a degree mix by sine
# and cosine, channels 0, 2, 6 and 12 stay as they are, and a turn by 0 degrees changes nothing. The first order comes
# out so. In the second, channel 5 (T) has the wrong sign whatever the yaw is, as if what is above on the left were above
# on the right. In the third, channel 12 (K) is 3.5 times as large, which adds lobes above and below. All others are
# right within 5 %, which shelf filters of the processor take.
#
# It concerns programs that turn scenes of second and third order with it; VLC of Debian 12 plays ambisonic sound by this
# library. Turn with another one, or use the first order. Channel 12 has been known to the project since 2021 (issue 32).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libspatialaudio0 libspatialaudio-dev; do
  apt-get -qq download $package=0.3.0+git20180730+dfsg1-2+b1 2>/dev/null
done
for package in *.deb; do dpkg -x "$package" .; done

cat >turn.cpp <<'EOF'
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <spatialaudio/AmbisonicProcessor.h>

// What a channel of a scene of third order that is constant gives in all channels, after the filters have settled.
static std::vector<double> turned(int channel, double yaw) {
  const unsigned frames = 4096;
  CAmbisonicProcessor processor;
  processor.Configure(3, true, frames, 0);
  processor.SetOrientation(Orientation(static_cast<float>(yaw), 0, 0));
  processor.Refresh();
  CBFormat scene;
  scene.Configure(3, true, frames);
  std::vector<float> ones(frames, 1), zeros(frames, 0), out(frames);
  for (int block = 0; block < 3; ++block) {
    for (int c = 0; c < 16; ++c) scene.InsertStream(c == channel ? ones.data() : zeros.data(), c, frames);
    processor.Process(&scene, frames);
  }
  std::vector<double> seen;
  for (int c = 0; c < 16; ++c) {
    scene.ExtractStream(out.data(), c, frames);
    seen.push_back(out[frames / 2]);
  }
  return seen;
}

// The same by the closed form: sin(m (azimuth - yaw)) and cos(m (azimuth - yaw)), of degrees -m and m.
static double closed_form(int to, int from, double yaw) {
  const int order = static_cast<int>(std::sqrt(to)), m = to - order * order - order, n = from - order * order - order;
  if (static_cast<int>(std::sqrt(from)) != order || std::abs(m) != std::abs(n)) return 0;
  return m == n ? std::cos(m * yaw) : (m < 0 ? -1 : 1) * std::sin(std::abs(m) * yaw);
}

int main() {
  for (const int degrees : {0, 30, -90}) {
    std::printf("yaw of %d degrees:", degrees);
    std::vector<std::vector<double>> columns;
    const double yaw = degrees * 3.14159265358979 / 180;
    for (int from = 0; from < 16; ++from) columns.push_back(turned(from, yaw));
    for (int to = 0; to < 16; ++to) {
      double along = 0, power = 0, rest = 0;
      for (int from = 0; from < 16; ++from) {
        along += columns[from][to] * closed_form(to, from, yaw);
        power += std::pow(closed_form(to, from, yaw), 2);
      }
      for (int from = 0; from < 16; ++from)
        rest = std::fmax(rest, std::fabs(columns[from][to] - along / power * closed_form(to, from, yaw)));
      if (rest > 0.05) std::printf(" channel %d mixes otherwise;", to);
      else if (std::fabs(along / power - 1) > 0.05) std::printf(" channel %d is %.1f times the closed form;", to, along / power);
    }
    std::puts("");
  }
}
EOF
library=usr/lib/x86_64-linux-gnu
c++ -O1 -Iusr/include -Iusr/include/spatialaudio turn.cpp -o turn $library/libspatialaudio.so.0
LD_LIBRARY_PATH=$library ./turn | tee seen
cat >expected <<'EOF'
yaw of 0 degrees: channel 5 is -1.0 times the closed form; channel 12 is 3.5 times the closed form;
yaw of 30 degrees: channel 5 is -1.0 times the closed form; channel 12 is 3.5 times the closed form;
yaw of -90 degrees: channel 5 is -1.0 times the closed form; channel 12 is 3.5 times the closed form;
EOF
cmp -s seen expected || { echo "How libspatialaudio turns a scene has changed."; exit 1; }
