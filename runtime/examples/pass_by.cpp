// pass_by.cpp: turns the emitters of a bake down, lets a tone of its own pass in front of a
// listener from left to right, and prints how loud each second is at either ear: pass_by
// LEVEL.clamor X Y Z
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <clamor.hpp>

namespace {

constexpr double kRate_hz = 48000, kSeconds = 4, kSpeed_mps = 1.5, kTwoPi = 6.283185307179586;
constexpr std::uint32_t kBlock = 480;

std::vector<float> tone() {
  std::vector<float> samples(48000);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] =
        static_cast<float>(0.5 * std::sin(kTwoPi * 700 * static_cast<double>(i) / kRate_hz));
  return samples;
}

}  // namespace

int main(int count, char** words) {
  if (count != 5) return std::fputs("pass_by LEVEL.clamor X Y Z\n", stderr), 2;
  const double x = std::atof(words[2]), y = std::atof(words[3]), z = std::atof(words[4]);
  try {
    clamor_options updates = clamor::context_options();
    updates.caller_updates = 1;
    clamor::Clamor clamor(updates);
    clamor::OpenLevel level = clamor.open(words[1]);
    for (std::uint32_t i = 0; i < level.info().emitters; ++i) level.change_emitter(i, 0);
    clamor_listener_options options = clamor::listener_options();
    options.offline = 1;
    options.pose = {{x, y, z}, {0, 0, 0, 1}};
    clamor::Ears ears = clamor.listen(level, options);

    const clamor::Sound sound =
        clamor.add_sound(tone(), static_cast<std::uint32_t>(kRate_hz), true);
    const clamor::Group vehicles = clamor.add_group();
    clamor_source_options passing = clamor::source_options();
    passing.sound = sound.handle();
    passing.group = vehicles.handle();
    clamor_motion motion{{x - kSpeed_mps * kSeconds / 2, y, z - 1}, {kSpeed_mps, 0, 0}, {}};
    passing.motion = motion;
    clamor::Source source = clamor.add_source(passing);

    std::vector<float> block(kBlock * ears.channels());
    for (int second = 0; second < kSeconds; ++second) {
      double power[2] = {0, 0};
      for (int i = 0; i < kRate_hz / kBlock; ++i) {
        while (const auto time_s = ears.next_keyframe_s()) {
          motion.position_m[0] = x + kSpeed_mps * (*time_s - kSeconds / 2);
          source.move(motion);
          clamor.commit(*time_s);
          clamor.update();
        }
        clamor::check(ears.render(block, kBlock));
        for (std::size_t s = 0; s < block.size(); ++s) power[s % 2] += block[s] * block[s];
      }
      std::printf("second %d: left %5.1f dB, right %5.1f dB\n", second,
                  10 * std::log10(power[0] / kRate_hz), 10 * std::log10(power[1] / kRate_hz));
    }
  } catch (const clamor::Failure& failure) {
    std::fprintf(stderr, "pass_by: %s\n", failure.what());
    return 1;
  }
  return 0;
}
