// live_sound.h: the sound of the window: plays a bake through the player of `clamor play`, and
// crossfades to others, while looping sounds go on where they are.
//
// Bakes and devices are opened on a thread of its own, because that takes long; update() takes over
// what has been opened.
//
// Threads: all functions on one thread.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/listener.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/engine/heard_source.h"
#include "runtime/engine/solo_settings.h"
#include "runtime/player/player.h"
#include "runtime/player/player_options.h"
#include "runtime/player/player_statistics.h"
#include "runtime/realtime/thread_cpu_usage.h"
#include "tools/analysis/spectrogram.h"
#include "tools/view/level_doors.h"

namespace clamor {

// The last seconds of what was played, as a spectrogram and as levels.
//
// Threads: add() on one thread, all others on one other.
class SoundHistory {
 public:
  static constexpr double kColumn_s = 0.1, kSeconds = 12;
  using Column = std::array<float, kThirdOctaves>;  // mean power per third octave, of all channels

  explicit SoundHistory(int channels) : channels_(static_cast<std::size_t>(channels)) {}

  // Takes interleaved samples.
  void add(std::span<const float> interleaved);

  // Computes the columns that are due; call often. A column takes a millisecond.
  void update();
  // The newest last.
  const std::deque<Column>& columns() const { return columns_; }

 private:
  static constexpr std::size_t kWindow_frames = 16384;  // that of spectrogram_of()

  const std::size_t channels_;
  std::mutex mutex_;            // guards what follows
  std::vector<float> waiting_;  // mono, not yet taken by update()
  std::size_t part_ = 0;        // samples of the next frame that were added
  float sum_ = 0;

  std::vector<float> window_;     // of update(), the newest last
  std::size_t since_column_ = 0;  // frames
  std::deque<Column> columns_;
};

class LiveSound {
 public:
  // `options` are those of the player that the first play() makes.
  LiveSound(PlayerOptions options, FileAccess access);
  ~LiveSound();

  // Plays this bake as soon as it is open. Only the newest request counts. `name` is for people.
  void play(const std::string& path, const std::string& name);
  // Plays with other options, as with another number of voices. Output channels cannot change.
  void set_options(const AuralizerOptions& options);
  const AuralizerOptions& options() const { return options_.auralizer; }

  void move(const Listener& listener);
  void set_focus(const SoloSettings& focus);
  const SoloSettings& focus() const { return focus_; }
  // Opens and closes doors of what plays, and of what will.
  void set_doors(const LevelDoors& doors);

  // Call in every frame. Returns whether another bake plays from now on.
  bool update();

  bool is_playing() const { return player_ != nullptr; }
  bool is_opening() const { return is_opening_; }
  const std::string& name() const { return name_; }    // of what plays
  const std::string& error() const { return error_; }  // of the last request, or ""
  std::shared_ptr<const BakeFile> file() const { return file_; }
  PlayerStatistics statistics() const;
  std::vector<ThreadCpuUsage> thread_shares() const;  // reads files
  void copy_heard(std::vector<HeardSource>& heard) const;
  SoundHistory& history() { return *history_; }

  // Ends the sound and completes the recording.
  Result<void> stop();

 private:
  struct Request {
    std::string path, name;
    AuralizerOptions options;
    Listener listener;
  };
  // The player for the first request, a prepared bake for others.
  struct Opened {
    Request request;
    std::shared_ptr<const BakeFile> file;
    std::unique_ptr<Player> player;
    std::unique_ptr<Player::Prepared> prepared;
    std::string error;
  };

  void submit(Request next);
  void run(const std::stop_token& ended);
  Opened open(Request request, const Player* playing) const;

  PlayerOptions options_;
  const FileAccess access_;
  const std::shared_ptr<SoundHistory> history_;
  std::shared_ptr<const BakeFile> file_;
  std::unique_ptr<Player> player_;  // made by the thread, then left to the caller
  std::string path_, name_, error_;
  Listener listener_;
  SoloSettings focus_;
  LevelDoors doors_;
  bool is_opening_ = false;

  std::mutex mutex_;  // guards what follows
  std::condition_variable_any asked_;
  std::optional<Request> next_;
  std::optional<Opened> opened_;
  bool is_handing_over_ = false;  // update() is taking over what was opened
  const Player* playing_ = nullptr;
  std::jthread thread_;
};

}  // namespace clamor
