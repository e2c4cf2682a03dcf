// play_command.cpp: clamor play: plays a bake in real time.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ostream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_writer.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/player/player.h"
#include "runtime/player/player_options.h"
#include "runtime/player/player_statistics.h"
#include "runtime/realtime/thread_cpu_usage.h"
#include "tools/analysis/spectrogram.h"
#include "tools/commands/commands.h"
#include "tools/commands/keyboard_walk.h"
#include "tools/commands/place_warnings.h"
#include "tools/commands/play_history.h"
#include "tools/commands/play_status.h"
#include "tools/commands/sound_options.h"
#include "tools/program/arguments.h"
#include "tools/program/bake_file_watcher.h"
#include "tools/program/interrupt.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal.h"
#include "tools/program/terminal_output.h"
#include "tools/view/walk_camera.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kFrame_ms = 20, kMovingFrame_ms = 5;           // of the display
constexpr auto kFileCheck = std::chrono::milliseconds(500);  // for another bake in its place

struct PlayRequest {
  std::string level, walk_path, report_folder;
  std::optional<Listener> listener;  // at the start
  bool follows = false;
  PlayerOptions options;
};

// Notices that the bake was replaced while it plays, and switches to the new one if wanted.
class BakeFollower {
 public:
  // `follows`: switch to the new file; otherwise only report it. `mix` must outlive the follower.
  BakeFollower(std::shared_ptr<const BakeFile> file, bool follows, const MixArguments& mix)
      : file_(std::move(file)), watcher_(*file_), follows_(follows), mix_(mix) {}

  // Checks the file system and reports each change once. Returns true if another bake plays
  // from now on.
  bool check(Player& player, AuralizerOptions options, std::ostream& err);

 private:
  Result<void> switch_to_new(Player& player, AuralizerOptions& options);

  std::shared_ptr<const BakeFile> file_;
  BakeFileWatcher watcher_;
  const bool follows_;
  const MixArguments& mix_;
};

bool BakeFollower::check(Player& player, AuralizerOptions options, std::ostream& err) {
  const BakeFileWatcher::Change change = watcher_.check();
  if (change == BakeFileWatcher::Change::kNone) return false;
  const bool is_replaced = change == BakeFileWatcher::Change::kReplaced;
  const std::string what =
      fmt::format("{} was {}", file_->path(), is_replaced ? "replaced" : "overwritten");
  if (!follows_) {
    fmt::print(err, "{} on disk; {}. 'clamor play --follow' switches to the new one\n", what,
               is_replaced ? "the old one keeps playing"
                           : "the parts of the old one in memory keep playing");
    return false;
  }
  const Result<void> switched = switch_to_new(player, options);
  if (switched.ok())
    fmt::print(err, "{} on disk; the new one plays\n", what);
  else
    fmt::print(err, "{} on disk, but the old one keeps playing: {}\n", what,
               switched.error().message);
  return switched.ok();
}

Result<void> BakeFollower::switch_to_new(Player& player, AuralizerOptions& options) {
  auto opened = BakeFile::open(file_->path(), mix_.access());
  if (!opened.ok()) return opened.error();
  InputFiles inputs;  // compared with the outputs when the program started
  if (const auto read = mix_.read_script(options, opened->signal_count(), inputs); !read.ok())
    return read;
  auto file = std::make_shared<const BakeFile>(std::move(*opened));
  if (const auto replaced = player.replace(file, options); !replaced.ok()) return replaced;
  file_ = std::move(file);
  watcher_.plays(*file_);
  return {};
}

// Opens the bake and reads all other input files, then checks that no output replaces one of them.
Result<BakeFile> read_inputs(PlayRequest& request, const MixArguments& mix,
                             const OutputArguments& output) {
  PlayerOptions& options = request.options;
  InputFiles inputs;
  inputs.add(request.level);
  inputs.add(request.walk_path);
  auto file = BakeFile::open(request.level, mix.access());
  if (!file.ok()) return file;
  if (const auto read = output.read_head(options.auralizer.output, inputs); !read.ok())
    return read.error();
  if (const auto read = mix.read_script(options.auralizer, file->signal_count(), inputs);
      !read.ok())
    return read.error();
  if (request.listener) {
    options.listener = *request.listener;
  } else {
    options.listener = in_front_of_first(file->emitters());
    options.listener.position_m += file->origin_m();
  }
  if (!request.walk_path.empty()) {
    auto walk = Walk::read(request.walk_path);
    if (!walk.ok()) return walk.error();
    if (options.seconds == 0) options.seconds = walk->length_s();
    options.walk = std::move(*walk);
  }
  if (!options.record.empty())
    if (const auto target = OutputTarget::find(options.record, inputs); !target.ok())
      return target.error().in("--record");
  if (!request.report_folder.empty())
    if (const auto can = PlayHistory::check_folder(request.report_folder, inputs); !can.ok())
      return can.error().in("--report");
  return file;
}

// Prints the status line: every 100 ms in place on a terminal, every second elsewhere.
class StatusDisplay {
 public:
  StatusDisplay(std::ostream& err, int channels) : err_(err), channels_(channels) {}

  void update(PlayerStatistics status, const Listener& listener) {
    for (std::size_t c = 0; c < peak_.size(); ++c)
      peak_[c] = std::max(peak_[c], status.auralizer.peak[c]);
    const auto now = Clock::now();
    if (now - shown_ < std::chrono::milliseconds(is_terminal(err_) ? 100 : 1000)) return;
    shown_ = now;
    status.auralizer.peak = std::exchange(peak_, {});
    show_line(err_, status_fields(status, listener, channels_));
  }

 private:
  std::ostream& err_;
  const int channels_;
  Clock::time_point shown_ = Clock::now();
  std::array<float, kMaxChannels> peak_{};  // since the last line
};

// Moves the listener and prints the status until the end, Q or Ctrl-C.
void run(Player& player, const PlayerOptions& options, BakeFollower& follower, PlayHistory& history,
         std::ostream& err) {
  Terminal terminal;
  if (terminal.is_terminal() && !options.walk)
    fmt::print(err,
               "arrow keys or WASD walk and turn, comma and period step sideways, R and F move up "
               "and down, Q quits\n");
  KeyboardWalk keyboard(options.listener);
  PlayNotices notices(err);
  StatusDisplay display(err, options.auralizer.output.channels());
  auto moved = Clock::now(), checked = moved;
  // JACK's library blocks SIGPIPE, so Interrupt may miss it.
  while (!player.finished() && !Interrupt::requested() && !output_reader_is_gone()) {
    // A key ends the wait at once. While the listener glides, frames are shorter.
    const bool is_moving = !options.walk && keyboard.is_moving();
    const Key key = terminal.read(is_moving ? kMovingFrame_ms : kFrame_ms);
    if (key == Key::kQuit) break;
    keyboard.press(key);
    const PlayerStatistics status = player.statistics();
    notices.tell(status);
    Listener listener = keyboard.listener();
    if (options.walk) {
      listener = options.walk->at(status.time_s);
    } else {
      const auto now = Clock::now();
      keyboard.advance(std::chrono::duration<double>(now - moved).count());
      moved = now;
      listener = keyboard.listener();
      player.move(listener);
    }
    history.add(status, listener);
    if (const auto now = Clock::now(); now - checked >= kFileCheck) {
      checked = now;
      if (follower.check(player, options.auralizer, err)) notices.forget_file();
    }
    display.update(status, listener);
  }
  notices.tell(player.statistics());  // failures since the last frame
}

// Nothing if nothing was recorded to a file.
std::optional<Spectrogram> spectrogram_of_file(const std::string& path, std::ostream& err) {
  const auto target = OutputTarget::find(path);
  if (!target.ok() || target->is_stream()) return {};
  const auto sound = read_channels(path, kMaxChannels);
  if (sound.ok()) return spectrogram_of(*sound);
  fmt::print(err, "no spectrogram: {}\n", sound.error().message);
  return {};
}

// Plays, then prints the summary and writes the report.
Result<void> play(PlayRequest& request, const MixArguments& mix, const OutputArguments& output,
                  std::ostream& err) {
  auto file = read_inputs(request, mix, output);
  if (!file.ok()) return file.error();
  const PlayerOptions& options = request.options;
  print_place_warnings(*file, options.walk.value_or(Walk::standing(options.listener)),
                       options.seconds, options.auralizer, err);
  const Interrupt interrupt;
  const auto playing = std::make_shared<const BakeFile>(std::move(*file));
  BakeFollower follower(playing, request.follows, mix);
  StageNotice notice(err);
  notice.begin("preparing the level's surfaces");
  auto player = Player::create(playing, options);
  notice.end();
  if (!player.ok()) return player.error();
  fmt::print(err, "playing {} on {}\n", request.level, describe((*player)->statistics().output));
  if (const std::string note = output.default_output_note(); !note.empty())
    fmt::print(err, "{}\n", note);
  if (const SoundStatistics sounds = (*player)->statistics().auralizer.sounds; sounds.all_bytes > 0)
    fmt::print(err, "{}\n", sounds_line(sounds));
  if (const auto started = (*player)->start(); !started.ok()) return started;
  PlayHistory history;
  run(**player, options, follower, history, err);
  PlayerStatistics played = (*player)->statistics();
  const auto threads = (*player)->thread_shares();
  if (const auto stopped = (*player)->stop(); !stopped.ok()) return stopped;
  played.output = (*player)->statistics().output;  // includes closing the device

  print_play_summary(played, history, threads, err);
  if (!options.record.empty())
    fmt::print(
        err, "recorded {}{}\n", options.record,
        played.dropped_samples > 0
            ? fmt::format(", but the disk was too slow for {} samples", played.dropped_samples)
            : "");
  if (request.report_folder.empty()) return {};
  const auto heard = spectrogram_of_file(options.record, err);
  if (const auto written =
          history.write(request.report_folder, request.level, played, threads, heard);
      !written.ok())
    return written;
  fmt::print(err, "wrote {0}/play.html, play.json and tables as CSV\n", request.report_folder);
  return {};
}

}  // namespace

int run_play(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  PlayRequest request;
  PlayerOptions& options = request.options;
  Arguments parser("play",
                   "Plays a bake in real time. In a terminal, the arrow keys or WASD walk and "
                   "turn.",
                   "clamor play hall.clamor --listener 0,1.7,3,180 --voices 2000");
  parser.positional("bake", request.level, "the bake file");
  parser.listener(
      "--listener", request.listener,
      "start position X,Y,Z[,YAW[,PITCH]] in metres and degrees [unset: in front of the first "
      "emitter]");
  parser.option("--walk", request.walk_path, "follow the path in PATH.json instead");
  parser.option("--seconds", options.seconds,
                "duration; 0: until Q, Ctrl-C or the end of the walk");
  parser.within("--seconds", options.seconds, 0, 864000);
  DeviceArguments device(options);
  device.add_device_options(parser);
  MixArguments mix(parser, options.auralizer);
  parser.flag("--follow", request.follows,
              "when the file is replaced by another bake, crossfade to that; unset: print a note "
              "and play the old one to the end");
  device.add_recording_options(parser);
  parser.option("--report", request.report_folder,
                "at the end, write loudness, voices and load over time to this folder, as HTML, "
                "JSON and CSV; with --record also a spectrogram");
  OutputArguments output(parser, options.auralizer.output);
  parser.then([&] {
    if (request.listener && !request.walk_path.empty())
      return Result<void>(Error("give either --listener or --walk"));
    return device.interpret();
  });
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  return parser.end(err, play(request, mix, output, err));
}

}  // namespace clamor
