// cpp_client.cpp: a program that uses the library by clamor.hpp: sources, movable parts, portals.
//
//   cpp_client LEVEL     LEVEL is rooms_with_door() of library_room.h. Prints the promises that are
//                        broken, and exits with 0 if there are none.
//
// It is a program of its own because clamor.hpp shares names with the sources of the library.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "runtime/clamor.hpp"

namespace {

int failures = 0;

#define EXPECT(promise)                                 \
  do {                                                  \
    if (!(promise)) {                                   \
      std::printf("line %d: %s\n", __LINE__, #promise); \
      ++failures;                                       \
    }                                                   \
  } while (0)

template <class Call>
clamor_result code_of(const Call& call) {
  try {
    call();
  } catch (const clamor::Failure& failure) {
    return failure.code();
  }
  return CLAMOR_OK;
}

bool is_near(double value, double expected) { return std::abs(value - expected) < 0.01 * expected; }

constexpr clamor_pose kClosed{{3.4, 0, 4.5}, {0, 0, 0, 1}}, kOpen{{3.4, 0, 4.5}, {0, 1, 0, 1}};

clamor_options caller_updates() {
  clamor_options options = clamor::context_options();
  options.caller_updates = 1;
  return options;
}

clamor_listener_options offline() {
  clamor_listener_options options = clamor::listener_options();
  options.offline = 1;
  options.output = CLAMOR_OUTPUT_RECEIVERS;
  options.pose = {{4, 1.6, 7}, {0, 0, 0, 1}};
  return options;
}

std::vector<float> tone() {
  std::vector<float> samples(4800);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<float>(std::sin(static_cast<double>(i) * 3.141592653589793 / 24));
  return samples;
}

// A listener in one of two rooms, and a sound for sources in the other one behind the door.
struct Rooms {
  explicit Rooms(const std::string& path) : level(clamor.open(path)) {}

  clamor_source_options source(std::optional<double> reverberation) const {
    clamor_source_options options = clamor::source_options();
    options.sound = sound.handle();
    options.motion = {{4, 1.6, 3}, {}, {}};
    options.has_reverberation = reverberation.has_value();
    options.reverberation = reverberation.value_or(0);
    return options;
  }

  // Sources that were removed go on reverberating.
  void let_them_die_away() {
    for (int i = 0; i < 12; ++i) power();
  }

  // The power of the last quarter of the next half second.
  double power() {
    std::vector<float> block(2 * 480);
    double sum = 0;
    for (int i = 0; i < 50; ++i) {
      while (const auto time_s = ears.next_keyframe_s()) {
        clamor.commit(*time_s);
        clamor.update();
      }
      clamor::check(ears.render(block, 480));
      if (i < 25) continue;
      for (const float sample : block) sum += static_cast<double>(sample) * sample;
    }
    return sum;
  }

  clamor::Clamor clamor{caller_updates()};
  clamor::OpenLevel level;
  clamor::Ears ears = clamor.listen(level, offline());
  clamor::Sound sound = clamor.add_sound(tone(), 48'000, true);
};

void open_the_door_of_a_level(Rooms& rooms) {
  clamor::OpenLevel& level = rooms.level;
  const clamor::Source source = rooms.clamor.add_source(rooms.source({}));
  EXPECT(level.info().parts == 1 && level.info().portals == 1);
  std::optional<clamor::LevelPart> door = level.find_part("Door");
  EXPECT(door && door->handle() == level.part(0).handle());
  EXPECT(!level.find_part("Gate"));
  EXPECT(code_of([&] { level.part(1); }) == CLAMOR_ERROR_ARGUMENT);
  EXPECT(door->info().triangles == 12 && door->info().name == std::string("Door"));
  const std::optional<std::uint32_t> portal = level.find_portal("Door");
  EXPECT(portal && level.portal(*portal).name == std::string("Door"));
  EXPECT(!level.find_portal("Gate"));
  EXPECT(code_of([&] { level.set_portal(*portal, 2); }) == CLAMOR_ERROR_ARGUMENT);

  level.set_portal(*portal, 0);
  const double closed = rooms.power();
  door->move(kOpen);
  EXPECT(door->info().pose.orientation[1] > 0.7);
  const double open_door = rooms.power();
  EXPECT(open_door > 100 * closed);
  level.set_portal(*portal, 1);
  EXPECT(!is_near(rooms.power(), open_door));
  door->move(kClosed);
  door->enable(false);
  EXPECT(door->info().is_disabled != 0);
  EXPECT(rooms.power() > 100 * closed);
}

void change_the_reverberation_of_a_source(Rooms& rooms) {
  clamor::Source source = rooms.clamor.add_source(rooms.source({}));
  const double whole = rooms.power();
  source.change(rooms.source(0));
  EXPECT(!is_near(rooms.power(), whole));
  source.change(rooms.source(10));
  EXPECT(rooms.power() > 10 * whole);
  for (const double hostile : {-1.0, std::nan(""), HUGE_VAL, 1e7})
    EXPECT(code_of([&] { source.change(rooms.source(hostile)); }) == CLAMOR_ERROR_ARGUMENT);
}

void add_and_remove_a_board(Rooms& rooms) {
  const clamor::Source source = rooms.clamor.add_source(rooms.source(0));
  const double before = rooms.power();
  clamor_part_options options = clamor::part_options();
  options.pose = kClosed;
  options.half_extents_m[0] = options.half_extents_m[1] = 20;
  options.half_extents_m[2] = 0.02;
  clamor_part handle = 0;
  {
    clamor::Part board = rooms.clamor.add_part(options);
    handle = board.handle();
    EXPECT(board.info().triangles == 12 && board.info().name == std::string());
    EXPECT(rooms.power() < 0.01 * before);
    board.move({{0, 0, 100}, {0, 0, 0, 1}});
    EXPECT(is_near(rooms.power(), before));
    board.move(kClosed);
    board.enable(false);
    EXPECT(is_near(rooms.power(), before));
    board.enable(true);
    EXPECT(rooms.power() < 0.01 * before);
  }
  EXPECT(is_near(rooms.power(), before));
  EXPECT(clamor_enable_part(rooms.clamor.get(), handle, 1) == CLAMOR_ERROR_HANDLE);
  options.transmission[0] = 2;
  EXPECT(code_of([&] { rooms.clamor.add_part(options); }) == CLAMOR_ERROR_ARGUMENT);
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return 2;
  try {
    Rooms rooms(words[1]);
    open_the_door_of_a_level(rooms);
    rooms.let_them_die_away();
    change_the_reverberation_of_a_source(rooms);
    rooms.let_them_die_away();
    add_and_remove_a_board(rooms);
  } catch (const clamor::Failure& failure) {
    std::printf("%s\n", failure.what());
    return 1;
  }
  return failures == 0 ? 0 : 1;
}
