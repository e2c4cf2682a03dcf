// sources.h: the sounds that nodes of a game in Godot play, by the numbers under which scripts know
// them.
//
// A short AudioStream is decoded once, by the world's loader, and is shared by all sources that
// play it at its own pitch: such a source costs what one of the C interface does. Every other
// source has a stream of its own, which is decoded on the thread that makes keyframes. Once a
// frame, the places of all nodes are read, and what has changed is given to the world's publisher,
// which may wait for a keyframe where the main thread must not. While it is still busy, changes
// wait for the next frame.
//
// Threads: the main thread alone.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <clamor.h>

#include "runtime/bindings/godot/engine.h"

namespace clamor::godot {

class World;

// An AudioStream, decoded.
struct SharedSound {
  std::atomic<clamor_result> result = 1;  // of decoding; 1: under way
  clamor_sound handle = 0;                // once the result is CLAMOR_OK
  double length_s = 0;
  bool loops = false;
  double used_s = 0;  // when a source last played it
};

// An AudioStreamPlayback that is decoded while it plays.
struct StreamedSound {
  Value playback;
  std::atomic<double> pitch = 1;
  std::atomic<std::uint64_t> pulled = 0;  // frames, silence included
  std::atomic<std::uint64_t> ended = 0;   // `pulled` where the stream ended; 0: it plays
  std::uint64_t playing_until = 0;        // `pulled` up to which it has said that it plays
  clamor_sound handle = 0;                // the publisher's
};

// A sound that a node plays.
struct Voice {
  Integer number = 0;
  Object node = nullptr;  // null once the node does not play it any more
  Value stream;
  std::shared_ptr<SharedSound> shared;  // or
  std::shared_ptr<StreamedSound> streamed;
  clamor_source_options options{};
  Transform place{};
  double played_s = 0;
  bool is_added = false, is_changed = false, has_moved = false, has_frame = false;
  bool is_over = false, is_stopped = false;
  double over_s = 0;                      // when it ended or was stopped
  std::atomic<clamor_result> result = 0;  // of adding it
  clamor_source source = 0;               // the publisher's
};

class GameSources {
 public:
  explicit GameSources(World& world) : world_(world) {}

  // Plays `stream` from a position on, where the node is, until the node's _on_ended(number) is
  // called.
  Integer play(Object node, const Value& stream, const Value& options, double from_s);
  void change(Integer number, const Value& options);
  void stop(Integer number);
  double position_s(Integer number) const;
  // Maps places of Godot's to the level's.
  void set_origin(const Transform& origin);

  // Publishes what has changed, after `elapsed_s` of playing. Nodes have moved for `moved_s`.
  void frame(double elapsed_s, double moved_s);
  // Offline, by the thread that makes keyframes: puts sources where their nodes would be so much
  // later than at the last frame.
  void move_on(double later_s);
  void clear();

 private:
  enum class Kind { kAdd, kChange, kMove, kStop, kFree };
  struct Change {
    Kind kind;
    std::shared_ptr<Voice> voice;
    std::shared_ptr<SharedSound> shared;
    std::shared_ptr<StreamedSound> streamed;
    clamor_source_options options;
  };

  std::shared_ptr<Voice> voice(Integer number) const;
  void begin(Voice& begun, double from_s, double pitch);
  std::shared_ptr<SharedSound> shared_sound(const Value& stream);
  void advance(Voice& played, double elapsed_s);
  void follow(Voice& moved, double moved_s) const;
  bool publish(const std::shared_ptr<Voice>& published);
  void apply(Change& change) const;
  void forget_unused();

  World& world_;
  Integer last_ = 0;
  std::vector<std::shared_ptr<Voice>> voices_;  // by rising numbers
  std::map<std::pair<Integer, bool>, std::shared_ptr<SharedSound>>
      sounds_;  // by stream and looping
  Transform origin_{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  bool has_new_origin_ = false;
  double now_s_ = 0, looked_s_ = 0;
  std::vector<Change> changes_;  // the publisher's while is_publishing_
  std::atomic<bool> is_publishing_ = false;
  std::mutex moving_on_;  // of the list below: sources that moved in the last frame, offline
  std::vector<std::pair<clamor_source, clamor_motion>> moving_;
};

}  // namespace clamor::godot
