// player.h: plays a bake in real time.
//
// Threads:
//
//   caller   moves the listener, reads statistics
//   sampler  makes the keyframes that the auralizer wants; wakes every millisecond
//   audio    the output's: mixes (audio_callback.h)
//   writer   only while recording: from a ring buffer to the file
//
// A scripted walk is evaluated at the sample time of each keyframe, so the output is that of an
// offline render, sample for sample.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/result.h"

namespace clamor {

class Auralizer;
class BakeFile;
struct AuralizerInput;
struct AuralizerOptions;
struct HeardSource;   // runtime/engine/heard_source.h
struct SoloSettings;  // runtime/engine/solo_settings.h
struct Listener;
struct PlayerOptions;     // player_options.h
struct PlayerStatistics;  // player_statistics.h
struct ThreadCpuUsage;    // runtime/realtime/thread_cpu_usage.h

class Player {
 public:
  // Errors are those of Auralizer::create(), of the device and of the recording.
  static Result<std::unique_ptr<Player>> create(std::shared_ptr<const BakeFile> file,
                                                const PlayerOptions& options);
  static Result<std::unique_ptr<Player>> create(AuralizerInput input, const PlayerOptions& options);
  ~Player();  // stops

  Result<void> start();

  // Moves the listener. A rotation is heard with the next block or the one after it, a step within
  // two keyframes, unless the machine is overloaded. Not for walks.
  void move(const Listener& listener);

  // Changes what the bake that plays has, and not one that replaces it: its portals, movable parts
  // and moving sources. For the thread that calls move(); waits for a keyframe in progress.
  void change(const std::function<void(Auralizer& playing)>& act);

  // Crossfades to another bake within a tenth of a second; the listener stays, looping sounds go on
  // where they are, and others begin anew. Takes as long as opening a bake, during which the old
  // one plays on, and memory for both. After an error the old bake plays on. For the thread that
  // calls move() and statistics(), after start(). statistics().auralizer then counts from the
  // change on.
  //
  // A machine that is too busy to have the new bake ready in time mixes what was missed unheard,
  // but no more than half a second, because one that mixes slower than it plays would never be
  // done. Beyond that the crossfade is heard as ever, but looping sounds jump back by what is
  // missing.
  Result<void> replace(std::shared_ptr<const BakeFile> file, const AuralizerOptions& options);

  // The same in two steps. prepare() takes as long as opening a bake, on any thread, and makes
  // ready for a listener at this place or, with a walk, there. replace() makes the first keyframes,
  // which takes some ten milliseconds, and returns before the crossfade; the next call waits for
  // its end.
  struct Prepared {
    Prepared(std::unique_ptr<Auralizer> made, std::uint64_t frame);
    ~Prepared();
    std::unique_ptr<Auralizer> auralizer;
    std::uint64_t begins_at_frame;  // its time 0, of all that is played
  };
  Result<std::unique_ptr<Prepared>> prepare(std::shared_ptr<const BakeFile> file,
                                            AuralizerOptions options,
                                            const Listener& listener) const;
  Result<void> replace(std::unique_ptr<Prepared> prepared);

  // Listens to a part of the sound (Auralizer::set_focus()), also after replace(). For the thread
  // that calls move().
  void set_focus(const SoloSettings& focus);

  // Replaces `heard` by what the newest keyframe was made from (Auralizer::newest_sample());
  // nothing unless the options keep samples. Any thread; waits for a keyframe in progress.
  void copy_heard(std::vector<HeardSource>& heard) const;

  bool finished() const;  // PlayerOptions::seconds have been played
  PlayerStatistics statistics();
  std::vector<ThreadCpuUsage> thread_shares() const;  // since start(); reads files

  // Stops the sound and completes the recording, if any; its file has grown under its final name
  // since the first block.
  Result<void> stop();

 private:
  struct State;
  static Result<std::unique_ptr<Player>> create(Result<std::unique_ptr<Auralizer>> auralizer,
                                                const PlayerOptions& options);
  explicit Player(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
