// turn_around.cpp: turns a listener once around in a bake and prints how loud each quarter of the
// turn is at the left and the right ear: turn_around LEVEL.clamor X Y Z
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <clamor.hpp>

int main(int count, char** words) {
  if (count != 5) return std::fputs("turn_around LEVEL.clamor X Y Z\n", stderr), 2;
  constexpr double kSeconds = 4, kPi = 3.14159265358979323846;
  constexpr std::uint32_t kBlock = 480;
  try {
    clamor_options updates = clamor::context_options();
    updates.caller_updates = 1;
    clamor::Clamor clamor(updates);
    const clamor::OpenLevel level = clamor.open(words[1]);
    clamor_listener_options options = clamor::listener_options();
    options.offline = 1;
    clamor_pose pose{{std::atof(words[2]), std::atof(words[3]), std::atof(words[4])}, {0, 0, 0, 1}};
    options.pose = pose;
    clamor::Ears ears = clamor.listen(level, options);
    std::vector<float> block(kBlock * ears.channels());
    for (int quarter = 0; quarter < 4; ++quarter) {
      double power[2] = {0, 0};
      for (int i = 0; i < kSeconds * 48000 / 4 / kBlock; ++i) {
        while (const auto time_s = ears.next_keyframe_s()) {
          const double half_turn = kPi * *time_s / kSeconds;
          pose.orientation[1] = std::sin(half_turn);
          pose.orientation[3] = std::cos(half_turn);
          ears.move(pose);
          clamor.update();
        }
        clamor::check(ears.render(block, kBlock));
        for (std::size_t s = 0; s < block.size(); ++s) power[s % 2] += block[s] * block[s];
      }
      const double frames = kSeconds * 48000 / 4;
      std::printf("turned %3d to %3d degrees: left %5.1f dB, right %5.1f dB\n", 90 * quarter,
                  90 * (quarter + 1), 10 * std::log10(power[0] / frames),
                  10 * std::log10(power[1] / frames));
    }
  } catch (const clamor::Failure& failure) {
    return std::fprintf(stderr, "%s\n", failure.what()), EXIT_FAILURE;
  }
}
