// price_scenes.cpp: the scenes of tools/price that call the libraries instead of the program.
//
//   price_scenes city FILE                       writes ten million sources, by instances
//   price_scenes keyframes FILE X,Y,Z M/S COUNT  makes keyframes of a listener who walks from there
//   price_scenes render FILE X,Y,Z M/S COUNT     renders them, binaurally
//   price_scenes listener FILE                   creates the first binaural listener of libclamor
//   price_scenes import LEVEL                    reads a level
//
// Callgrind instruments and counts price_region() only, so that what comes before takes a fifth of
// the time.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "formats/bake_file/bake_writer.h"
#include "formats/gltf/level_import.h"
#include "runtime/clamor.h"
#include "tests/city.h"

#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#else
#define CALLGRIND_START_INSTRUMENTATION
#define CALLGRIND_STOP_INSTRUMENTATION
#endif

namespace clamor {
namespace {

constexpr std::size_t kBlockFrames = 960;
constexpr int kWarmUpKeyframes = 5;  // most pages are loaded and thresholds predicted by then

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "price_scenes: %s\n", what.c_str());
  std::exit(1);
}

template <class Work>
void price_region(const Work& work) {
  CALLGRIND_START_INSTRUMENTATION;
  work();
  CALLGRIND_STOP_INSTRUMENTATION;
}

void write_city(const std::string& path) {
  testing::CitySize size;
  size.stadiums = 1;
  if (const auto written = write_bake(path, testing::city(size, 1), 1); !written.ok())
    fail(written.error().message);
}

void import(const std::string& path) {
  price_region([&] {
    if (const auto level = import_level(path, {}); !level.ok()) fail(level.error().message);
  });
}

// A listener of the library, which ends with it.
class FirstListener {
 public:
  ~FirstListener() { clamor_destroy(context_); }

  void create(const std::string& bake, clamor_listener_options wanted) {
    clamor_options options{};
    options.bytes = sizeof(options);
    options.caller_updates = 1;
    wanted.bytes = sizeof(wanted);
    wanted.offline = 1;
    if (clamor_create(&options, &context_, &error_) != CLAMOR_OK ||
        clamor_open_level(context_, bake.c_str(), &level_, &error_) != CLAMOR_OK ||
        clamor_create_listener(context_, level_, &wanted, &listener_, &error_) != CLAMOR_OK)
      fail(error_.sentence);
  }

  // Makes keyframes while the listener walks along +X, and renders until `count` are made.
  void walk(const Vec3& from_m, double speed_mps, int count) {
    std::array<float, 2 * kBlockFrames> block{};
    while (count > 0) {
      std::uint32_t wanted = 0;
      double time_s = 0;
      check(clamor_next_keyframe(context_, listener_, &wanted, &time_s));
      if (wanted == 0) {
        check(clamor_render(context_, listener_, block.data(), kBlockFrames));
        continue;
      }
      const clamor_pose pose = {{from_m.x + speed_mps * time_s, from_m.y, from_m.z}, {0, 0, 0, 1}};
      check(clamor_move_listener(context_, listener_, &pose));
      check(clamor_update(context_, 0, nullptr));
      --count;
    }
  }

 private:
  static void check(clamor_result result) {
    if (result != CLAMOR_OK) fail(clamor_result_text(result));
  }

  clamor_context* context_ = nullptr;
  clamor_level level_ = 0;
  clamor_listener listener_ = 0;
  clamor_error error_{};
};

void create_listener(const std::string& bake) {
  FirstListener listener;
  price_region([&] { listener.create(bake, {}); });
}

void walk(std::uint32_t output, const std::string& bake, const std::string& place,
          const std::string& speed, const std::string& count) {
  Vec3 from_m{};
  if (std::sscanf(place.c_str(), "%lf,%lf,%lf", &from_m.x, &from_m.y, &from_m.z) != 3)
    fail("'" + place + "' is not a place X,Y,Z");
  clamor_listener_options wanted{};
  wanted.output = output;
  wanted.pose = {{from_m.x, from_m.y, from_m.z}, {0, 0, 0, 1}};
  FirstListener listener;
  listener.create(bake, wanted);
  listener.walk(from_m, std::stod(speed), kWarmUpKeyframes);
  price_region([&] { listener.walk(from_m, std::stod(speed), std::stoi(count)); });
}

}  // namespace
}  // namespace clamor

int main(int count, char** words) {
  const std::vector<std::string> word(words + 1, words + count);
  if (word.size() == 2 && word[0] == "city")
    clamor::write_city(word[1]);
  else if (word.size() == 5 && word[0] == "keyframes")
    clamor::walk(CLAMOR_OUTPUT_NONE, word[1], word[2], word[3], word[4]);
  else if (word.size() == 5 && word[0] == "render")
    clamor::walk(CLAMOR_OUTPUT_BINAURAL, word[1], word[2], word[3], word[4]);
  else if (word.size() == 2 && word[0] == "listener")
    clamor::create_listener(word[1]);
  else if (word.size() == 2 && word[0] == "import")
    clamor::import(word[1]);
  else
    clamor::fail("usage: price_scenes city|keyframes|render|listener|import FILE ...");
}
