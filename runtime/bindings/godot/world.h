// world.h: the levels, listeners, sources and movable parts of a game in Godot, by the numbers
// under which the add-on's scripts know them.
//
// There is one Clamor context. What takes long (opening and entering levels, creating listeners,
// decoding sounds) is done in order by a thread, the loader, and what may wait for a keyframe by
// another, the publisher, so that no frame and no block of audio waits; a number is valid at once,
// and what it stands for follows. Where `is_offline` (movies, tests), all is done where it is asked
// for, and keyframes are made before the block that needs them, so that the samples do not depend
// on the machine's speed. What moves is put where it will be at a keyframe's time, as it moved in
// the game's last frame, so that Doppler shifts are steady at any number of frames per second.
//
// Threads: the main thread alone, but for mix(), which is for Godot's audio thread and never waits.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <clamor.h>

#include "runtime/bindings/godot/engine.h"
#include "runtime/bindings/godot/sources.h"
#include "runtime/bindings/godot/worker.h"

struct clamor_context;

namespace clamor::godot {

template <class T>
T sized() {
  T structure{};
  structure.bytes = sizeof(structure);
  return structure;
}

enum Opening { kOpening = 0, kOpen = 1, kFailed = 2 };

struct Level {
  std::string node;  // whose errors name it
  std::atomic<int> state = kOpening;
  std::atomic<bool> is_closed = false;  // opening it would be in vain
  // Valid once it is open.
  clamor_level handle = 0;
  std::uint32_t sources = 0;
  std::vector<std::string> emitters, portals, parts;  // names
  std::vector<clamor_part> part_handles;
};

struct Listener {
  std::string node;
  std::mutex rendering;        // held while a block is rendered; the audio thread only tries it,
                               // but offline
  clamor_listener handle = 0;  // under `rendering`; 0: silence
  std::atomic<clamor_listener> known = 0;  // the same for the main thread
  std::atomic<bool> is_freed = false;      // creating it would be in vain
  std::atomic<bool> leaves = false;        // fades out within a block
  float gain = 1;                          // of the last frame; the audio thread's
  int channels = 2;
  // Beyond stereo: the newest block, and a bit for each pair of channels that nobody has taken of
  // it. The audio thread's.
  std::vector<float> block{};
  unsigned untaken = 0;
  std::atomic<double> load = 0;  // share of the audio thread's time, over half a second
  std::mutex telling;            // of the two below, never held while the library is asked
  clamor_listener_statistics statistics{};
  std::vector<Vector3> loudest{};  // what get_loudest_sources() returns next
  clamor_pose pose{};        // the newest; under `rendering` until there is a handle, or offline
  double velocity_mps[3]{};  // of the last frame, offline; under `rendering`
  double began_s = -1;       // on the game's clock, offline; under `rendering`
};

// Zeros for what is faster than anything moves, since it has leapt.
void velocity_between(const double* from_m, const double* to_m, double seconds, double* mps);

clamor_pose pose_of(const Value& position, const Value& rotation);

class World {
 public:
  static World& get();

  // A context is created at the first use of the world, and ends with close().
  bool open();
  void close();
  // Publishes what has changed, once a frame.
  void frame();

  Integer open_level(const Value& file, const std::string& path, const std::string& node);
  void close_level(Integer level);
  std::shared_ptr<Level> level(Integer number) const;

  Integer create_listener(Integer level, const Value& options, const std::string& node);
  void enter_level(Integer listener, Integer level);
  void free_listener(Integer listener);
  void move_listener(Integer listener, const Value& position, const Value& rotation);
  std::shared_ptr<Listener> listener(Integer number) const;

  // A number for a movable part, whose handle is the publisher's.
  Integer keep_part(clamor_part handle);
  // Has the publisher do something with a part's handle.
  void change_part(Integer part, std::function<void(clamor_part& handle)> change);
  void remove_part(Integer part);

  GameSources& sources() { return sources_; }
  Worker& loader() { return loader_; }
  Worker& publisher() { return publisher_; }
  clamor_context* context() const { return context_; }
  clamor_group paused() const { return paused_; }  // a group whose sounds stand still
  double rate_hz() const { return rate_hz_; }
  bool is_offline() const { return is_offline_; }
  void report(const std::string& node, const std::string& sentence) const;

  // Renders a block of stereo frames. Beyond stereo, they are silent, and take_pair() gives the
  // block's other frames, by pairs of channels.
  void mix(Listener& listener, float* frames, int count);
  static void take_pair(Listener& listener, int pair, float* frames, int count);

 private:
  void read_statistics(Listener& listener) const;
  void make_keyframes(Listener& listener);
  double elapsed_s();
  double moved_s() const;

  clamor_context* context_ = nullptr;
  clamor_group paused_ = 0;
  bool is_offline_ = false;
  double rate_hz_ = 48000;
  std::atomic<std::uint64_t> mixed_frames_ = 0;
  std::atomic<double> frame_s_ = 0;  // the game's time at its last frame, offline
  Integer last_ = 0;
  std::map<Integer, std::shared_ptr<Level>> levels_;
  std::map<Integer, std::shared_ptr<Listener>> listeners_;
  std::map<Integer, std::shared_ptr<clamor_part>> parts_;
  GameSources sources_{*this};
  std::chrono::steady_clock::time_point at_;  // of the last frame
  std::uint64_t at_frames_ = 0;               // `mixed_frames_` of it
  Worker loader_, publisher_;
};

}  // namespace clamor::godot
