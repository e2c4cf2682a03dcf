// player.h: a bake played in real time, with the threads of the design.
//
//   caller   moves the listener, reads statistics
//   sampler  wakes every few milliseconds and makes the keyframes that the auralizer wants
//   audio    the output's: mixes (audio_callback.h)
//   writer   only where the sound is recorded: from the ring to the WAV file
//
// A scripted walk is asked where the listener is at each keyframe's own moment in sample time, so
// what is heard is the offline render, sample for sample.
#pragma once

#include <memory>
#include <vector>

#include "common/listener.h"
#include "common/result.h"
#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

class Auralizer;
class BakeFile;
class MovingSources;
struct AuralizerInput;
struct AuralizerOptions;
struct PlayerOptions;
struct PlayerStatistics;

class Player {
 public:
  // Errors are those of Auralizer::create(), of the device and of the recording.
  static Result<std::unique_ptr<Player>> create(std::shared_ptr<const BakeFile> file,
                                                const PlayerOptions& options);
  static Result<std::unique_ptr<Player>> create(AuralizerInput input, const PlayerOptions& options);
  ~Player();  // stops

  Result<void> start();

  // Where the listener is from now on. A turn is heard with the next block or the one after it, a
  // step within two keyframes, where the machine is in time. Not for walks.
  void move(const Listener& listener);

  // As Auralizer's, for the thread that calls move().
  MovingSources* moving();

  // Plays another bake from now on, the listener where it is; the sound fades over in a tenth of a
  // second, and what the bake plays begins anew. Takes as long as opening, while the sound goes on,
  // and memory for both until then.
  // On an Error what plays goes on playing. For the thread that calls move() and statistics(), once
  // the player has started; statistics().auralizer then counts from the new bake on, and what
  // moving() gave is gone.
  Result<void> replace(std::shared_ptr<const BakeFile> file, const AuralizerOptions& options);

  bool finished() const;  // options.seconds have been played
  PlayerStatistics statistics();
  std::vector<ThreadCpuUsage> thread_shares() const;  // since start(); reads files

  // Ends the sound and, where it was recorded, completes the file, which has grown under its own
  // name since the first block.
  Result<void> stop();

 private:
  struct State;
  static Result<std::unique_ptr<Player>> create(Result<std::unique_ptr<Auralizer>> auralizer,
                                                const PlayerOptions& options);
  explicit Player(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
