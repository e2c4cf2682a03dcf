// world.h: the levels, listeners, sources and movable parts of a game in Godot, by the numbers
// under which the add-on's scripts know them.
//
// There is one Clamor context. What takes longer than microseconds (opening and entering levels,
// creating listeners) is done in order by a thread of the world's, so that no frame and no block of
// audio waits; a number is valid at once, and what it stands for follows. Where `is_offline`
// (movies, tests), all is done where it is asked for, and keyframes are made before the block that
// needs them, so that the samples do not depend on the machine's speed.
//
// Threads: the main thread alone, but for mix(), which is for Godot's audio thread and never waits.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <clamor.h>

#include "runtime/bindings/godot/engine.h"

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
  clamor_level handle = 0;  // valid once it is open
};

struct Listener {
  std::string node;
  std::mutex rendering;        // held while a block is rendered; the audio thread only tries it
  clamor_listener handle = 0;  // under `rendering`; 0: silence
  std::atomic<clamor_listener> known = 0;  // the same for the main thread
  std::atomic<bool> leaves = false;        // fades out within a block
  float gain = 1;                          // of the last frame; the audio thread's
  std::atomic<double> load = 0;            // share of the audio thread's time, over half a second
  clamor_pose pose{};                      // the newest; under `rendering` until there is a handle
};

// A sound that a source plays, from an AudioStreamPlayback of Godot's.
struct Voice {
  Value playback;
  std::atomic<double> pitch = 1;
  std::atomic<std::uint64_t> pulled = 0;  // frames, silence included
  std::atomic<std::uint64_t> ended = 0;   // `pulled` where the stream ended; 0: it plays
  clamor_sound sound = 0;
  clamor_source source = 0;
  clamor_source_options options{};
  std::uint64_t playing_until = 0;  // `pulled` up to which the stream has said that it plays
  bool is_over = false;             // it has ended or was stopped, and dies away
  std::uint64_t over_at = 0;        // frames that had been mixed by then
};

clamor_pose pose_of(const Value& position, const Value& rotation);

class World {
 public:
  static World& get();

  // A context is created at the first use of the world, and ends with close().
  bool open();
  void close();
  // Publishes what has changed, once a frame, and frees sources that have died away.
  void frame();

  Integer open_level(const Value& file, const std::string& path, const std::string& node);
  void close_level(Integer level);
  std::shared_ptr<Level> level(Integer number) const;

  Integer create_listener(Integer level, const Value& options, const std::string& node);
  void enter_level(Integer listener, Integer level);
  void free_listener(Integer listener);
  void move_listener(Integer listener, const Value& position, const Value& rotation);
  std::shared_ptr<Listener> listener(Integer number) const;

  Integer play(const Value& playback, const Value& options, const Value& position);
  std::shared_ptr<Voice> voice(Integer number) const;
  void change_source(Voice& voice, const Value& options);
  void move_source(Voice& voice, const Value& position, const Value& axis);
  void stop(Integer number);

  clamor_context* context() const { return context_; }
  double rate_hz() const { return rate_hz_; }
  bool is_offline() const { return is_offline_; }
  void report(const std::string& node, const std::string& sentence) const;

  // Renders a block of stereo frames.
  void mix(Listener& listener, float* frames, int count);

 private:
  void run(std::function<void()> job);
  void work();
  void make_keyframes(Listener& listener);
  void read_options(const Value& options, clamor_source_options& into) const;

  clamor_context* context_ = nullptr;
  clamor_group paused_ = 0;
  bool is_offline_ = false;
  double rate_hz_ = 48000;
  std::atomic<std::uint64_t> mixed_frames_ = 0;
  Integer last_ = 0;
  std::map<Integer, std::shared_ptr<Level>> levels_;
  std::map<Integer, std::shared_ptr<Listener>> listeners_;
  std::map<Integer, std::shared_ptr<Voice>> voices_;

  std::thread worker_;
  std::mutex queueing_;
  std::condition_variable queued_;
  std::deque<std::function<void()>> jobs_;
  bool ends_ = false;
};

}  // namespace clamor::godot
