// play_command.cpp: clamor play: plays a bake in real time.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <unistd.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_writer.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/emitter.h"
#include "runtime/player/player.h"
#include "tools/analysis/spectrogram.h"
#include "tools/commands/audibility_warnings.h"
#include "tools/commands/bake_follower.h"
#include "tools/commands/commands.h"
#include "tools/commands/keyboard_walk.h"
#include "tools/commands/mix_options.h"
#include "tools/commands/output_options.h"
#include "tools/commands/play_history.h"
#include "tools/commands/play_status.h"
#include "tools/commands/play_summary.h"
#include "tools/commands/strategy_options.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/printable_stream.h"
#include "tools/program/terminal.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kFrame_ms = 20, kMovingFrame_ms = 5;           // of the display
constexpr auto kFileCheck = std::chrono::milliseconds(500);  // for another bake in its place

// The words of the command line.
struct PlayRequest {
  std::string level, listener, walk_path, format, report_folder;
  bool no_limiter = false, follows = false;
  int frames = 0;
  PlayerOptions options;

  void add_options(Arguments& parser);
  void add_output_options(Arguments& parser);
};

void PlayRequest::add_options(Arguments& parser) {
  parser.positional("level", level, "the bake file");
  parser.option(
      "--listener", listener,
      "start position X,Y,Z[,YAW[,PITCH]] in metres and degrees [unset: in front of the first "
      "emitter]");
  parser.option("--walk", walk_path, "follow the path in PATH.json instead");
  parser.option("--seconds", options.seconds,
                "duration; 0: until Q, Ctrl-C or the end of the walk");
  parser.option("--device", options.device,
                "pulse, jack or alsa; the beginning or a part of a name that 'clamor devices' "
                "prints; or none");
  parser.option("--rate", options.device_rate_hz,
                "sample rate of the device in Hz; the mix is resampled [unset: 48000 if it has "
                "that]");
  parser.option("--frames", frames, {16, 8192},
                "frames per block; PulseAudio and ALSA buffer four blocks, JACK sets its own size "
                "[unset: 256, and PulseAudio's buffer grows, up to 0.2 s, when the device runs dry "
                "twice in 30 s]");
}

void PlayRequest::add_output_options(Arguments& parser) {
  parser.flag("--no-limiter", no_limiter,
              "let peaks clip instead of limiting true peaks to -1 dBFS");
  parser.flag("--follow", follows,
              "when the file is replaced by another bake, crossfade to that; unset: print a note "
              "and play the old one to the end");
  parser.option(
      "--record", options.record,
      "also record to this .wav or .flac file, or as WAV to a device or pipe such as "
      "/dev/stdout. The file grows while it plays: whatever ends the program, a .wav file "
      "can be played to its end, a .flac file to less than a second before");
  parser.option("--format", format,
                "sample format of the recording: float, 32, 24 or 16 [unset: float, or 24 for "
                ".flac]");
  parser.option("--report", report_folder,
                "at the end, write loudness, voices and load over time to this folder, as HTML, "
                "JSON and CSV; with --record also a spectrogram");
}

// Turns the words into player options. The Error is bad usage.
Result<void> interpret(PlayRequest& request, const StrategyArguments& strategy,
                       const MixArguments& mix, const OutputArguments& output) {
  PlayerOptions& options = request.options;
  const auto chosen = strategy.read();
  if (!chosen.ok()) return chosen.error();
  use(*chosen, options.auralizer);
  if (auto read = mix.read(options.auralizer); !read.ok()) return read;
  const auto format = output.read();
  if (!format.ok()) return format.error();
  options.auralizer.output = *format;
  options.auralizer.limit = !request.no_limiter;
  options.auralizer.adapt = true;
  options.auralizer.first_sounds_s = kFirstSoundsOfPlayer_s;
  if (!options.record.empty())
    if (const auto right = check_sound_file(options.record, format->channels()); !right.ok())
      return Error("--record: " + right.error().message);
  const auto samples = sample_format(request.format, options.record);
  if (!samples.ok()) return Error("--format: " + samples.error().message);
  options.record_format = *samples;
  if (!request.listener.empty() && !request.walk_path.empty())
    return Error("give either --listener or --walk");
  if (options.device_rate_hz != 0 &&
      (options.device_rate_hz < 8000 || options.device_rate_hz > 384000))
    return Error("--rate must lie between 8000 and 384000");
  if (!(options.seconds >= 0 && options.seconds <= 864000))
    return Error("--seconds must lie between 0 and 864000");
  if (!request.listener.empty()) {
    const auto listener = parse_listener(request.listener);
    if (!listener.ok()) return listener.error();
    options.pose = *listener;
  }
  if (request.frames > 0) options.block_frames = request.frames;
  options.buffer_may_grow = request.frames == 0;
  options.auralizer.block_frames = options.block_frames;
  return {};
}

// Two metres in front of the first emitter, looking at it.
Listener in_front_of_first(const std::vector<Emitter>& emitters) {
  if (emitters.empty()) return {};
  const Emitter& emitter = emitters.front();
  Vec3 ahead(emitter.axis.x, 0, emitter.axis.z);
  ahead = length(ahead) > 1e-6 ? normalize(ahead) : Vec3(0, 0, 1);
  return {emitter.position_m + 2.0 * ahead, std::atan2(ahead.x, ahead.z), 0};
}

// A listener who is moved by keys: a position, and a turn to the left since the start.
class KeyedListener {
 public:
  explicit KeyedListener(const Listener& start) : start_(start), position_m_(start.position_m) {}

  Listener listener() const {
    return {position_m_,
            turn_rad_ == 0 ? start_.orientation : start_.orientation.turned_left(turn_rad_)};
  }

  void apply(Key key) {
    const Vec3 up(0, 1, 0), forward = normalize(cross(up, listener().right()));
    const Vec3 right = cross(forward, up);
    switch (key) {
      case Key::kForward:
        position_m_ += kStep_m * forward;
        break;
      case Key::kBack:
        position_m_ -= kStep_m * forward;
        break;
      case Key::kLeft:
        position_m_ -= kStep_m * right;
        break;
      case Key::kRight:
        position_m_ += kStep_m * right;
        break;
      case Key::kTurnLeft:
        turn_rad_ += kTurn_rad;
        break;
      case Key::kTurnRight:
        turn_rad_ -= kTurn_rad;
        break;
      case Key::kUp:
        position_m_ += kStep_m * up;
        break;
      case Key::kDown:
        position_m_ -= kStep_m * up;
        break;
      case Key::kNone:
      case Key::kQuit:
        break;
    }
  }

  // Moves smoothly towards where keys have moved `wanted`. After a rest, the first step is at most
  // that of one frame.
  void glide_to(const KeyedListener& wanted, double seconds) {
    const double step_s = std::min(seconds, 1e-3 * kFrame_ms);
    const auto share = [step_s](double glide_s) { return 1 - std::exp(-step_s / glide_s); };
    position_m_ += share(kGlide_s) * (wanted.position_m_ - position_m_);
    turn_rad_ += share(kTurnGlide_s) * (wanted.turn_rad_ - turn_rad_);
  }

  bool is_at(const KeyedListener& wanted) const {
    constexpr double kNear = 1e-4;
    return length(wanted.position_m_ - position_m_) < kNear &&
           std::abs(wanted.turn_rad_ - turn_rad_) < kNear;
  }

 private:
  const Listener start_;
  Vec3 position_m_;
  double turn_rad_ = 0;
};

double heading_deg(const Orientation& orientation) {
  return kDegrees * std::atan2(-orientation.right().z, orientation.right().x);
}

std::string meter(float peak) {
  constexpr int kWidth = 12;
  const double level_db = 20 * std::log10(std::max(static_cast<double>(peak), 1e-4));
  const int lit =
      std::clamp(static_cast<int>(std::lround((level_db + 60) / 60 * kWidth)), 0, kWidth);
  return fmt::format("{}{} {:>5.1f}", std::string(static_cast<std::size_t>(lit), '#'),
                     std::string(static_cast<std::size_t>(kWidth - lit), '.'), level_db);
}

// Of both ears, or of the loudest of more channels.
std::string meters(const float (&peak)[kMaxChannels], int channels) {
  if (channels == 2) return "L " + meter(peak[0]) + " R " + meter(peak[1]);
  return meter(*std::max_element(peak, peak + channels));
}

// " (limited by 2.1 dB)" once the limiter has worked.
std::string limited_note(const Limiter::Work& limited) {
  if (limited.frames == 0) return "";
  return fmt::format(" (limited by {:.1f} dB)",
                     -20 * std::log10(static_cast<double>(limited.min_gain)));
}

// " (k 1200 of 2000, 87 shed)" where there is no time for all.
std::string load_note(const AuralizerStatistics& now) {
  if (now.k >= now.max_k && now.shed_voices == 0) return "";
  return fmt::format(" (k {} of {}, {} shed)", now.k, now.max_k, now.shed_voices);
}

// A second without what the budget leaves out is not worth a line: nearly any start has some.
constexpr std::uint64_t kMentionedKeyframes = 50;

// Says where fewer voices sounded than were asked for because nearly everything was hidden.
void tell_bounded_search(const AuralizerStatistics& played, std::ostream& err) {
  if (played.bounded_keyframes < kMentionedKeyframes) return;
  fmt::print(err,
             "nearly everything was hidden in {} of {} keyframes: the search for audible sources "
             "ended early there, with the right loudness on average but fewer voices\n",
             played.bounded_keyframes, played.keyframes);
}

// What was less than asked for, and for how long.
void tell_load(const AuralizerStatistics& played, std::ostream& err) {
  if (played.min_k >= played.max_k && played.shedding_blocks == 0) return;
  fmt::print(
      err,
      "too much for this machine: {} keyframes late, k fell to {} of {} and is {}; {} blocks "
      "without all voices, at most {} shed\n",
      played.late_keyframes, played.min_k, played.max_k, played.k, played.shedding_blocks,
      played.max_shed_voices);
}

std::string status_line(const PlayerStatistics& now, const Listener& listener, int channels) {
  return fmt::format(
      "{:6.1f} s  at {:.1f} {:.1f} {:.1f} yaw {:.0f}  {} voices{}  {} dBFS  {:.1f} LUFS, 3 s "
      "{:.1f}{}  cpu {:.0f} %  "
      "sampler {:.1f} ms  late {}  gaps {}  held {}{}",
      now.time_s, listener.position_m.x, listener.position_m.y, listener.position_m.z,
      heading_deg(listener.orientation), now.auralizer.voices, load_note(now.auralizer),
      meters(now.auralizer.peak, channels), std::max(now.momentary_lufs, -99.9),
      std::max(now.short_term_lufs, -99.9), limited_note(now.auralizer.limited),
      100 * now.output.callbacks.cpu_share, now.auralizer.sampler_ms, now.output.callbacks.late,
      now.output.callbacks.underflows, now.auralizer.held_blocks, device_note(now.output));
}

// Says so when pages of the file cannot be read (any more), the first time. The sound goes on.
void tell_of_failure(const PageStatistics& pages, bool& told, std::ostream& err) {
  if (told || pages.failed == 0) return;
  told = true;
  fmt::print(err, "warning: {} What has been read goes on and stands in for it.\n", pages.failure);
}

// The same of its sounds; once is enough where both fail.
void tell_of_failure(const SoundStatistics& sounds, bool& told, std::ostream& err) {
  if (told || sounds.failed == 0) return;
  told = true;
  fmt::print(err, "warning: {} What needs it is silent.\n", sounds.failure);
}

// What became of the sounds, where there is something to say.
void report(const SoundStatistics& sounds, std::ostream& err) {
  if (sounds.loaded > 0)
    fmt::print(err, "sounds: {} pieces decoded, {} dropped; {:.1f} MB of them kept{}\n",
               sounds.loaded, sounds.dropped, static_cast<double>(sounds.bytes) / 1e6,
               sounds.lock_refused ? fmt::format(", {:.1f} MB locked; 'ulimit -l' lets no more",
                                                 static_cast<double>(sounds.locked_bytes) / 1e6)
                                   : "");
  if (sounds.late > 0)
    fmt::print(err, "{} times a voice was silent for 20 ms because its sound was not decoded yet\n",
               sounds.late);
  if (sounds.crowded > 0)
    fmt::print(err, "{} times a sound found no room in memory; give more with --memory\n",
               sounds.crowded);
  if (sounds.failed > 0)
    fmt::print(err, "{} pieces of sounds could not be read; they were silent\n", sounds.failed);
}

// Nothing where nothing was recorded to a file, or more than is read of one.
std::optional<Spectrogram> spectrogram_of_file(const std::string& path, std::ostream& err) {
  const auto target = OutputTarget::find(path);
  if (!target.ok() || target->is_stream()) return {};
  const auto sound = read_channels(path, kMaxChannels);
  if (sound.ok()) return spectrogram_of(*sound);
  fmt::print(err, "no spectrogram: {}\n", sound.error().message);
  return {};
}

// Notices that the bake was replaced while it plays, and takes up the new one where that is wanted.
class BakeFollower {
 public:
  BakeFollower(std::shared_ptr<const BakeFile> file, bool follows, const MixArguments& mix)
      : file_(std::move(file)), watch_(*file_), follows_(follows), mix_(mix) {}

  // Says each thing once, with `before` in front. True if another bake plays from now on.
  bool look(Player& player, AuralizerOptions options, std::ostream& err, const char* before) {
    const BakeFileWatcher::News news = watch_.look();
    if (news == BakeFileWatcher::News::kNone) return false;
    const bool is_replaced = news == BakeFileWatcher::News::kReplaced;
    const std::string what =
        fmt::format("{}{} was {}", before, file_->path(), is_replaced ? "replaced" : "overwritten");
    if (!follows_) {
      fmt::print(
          err, "{} on disk; {}. 'clamor play --follow' takes up the new one\n", what,
          is_replaced ? "the old one plays on" : "what has been read of the old one plays on");
      return false;
    }
    const Result<void> taken = take_up(player, options);
    if (taken.ok())
      fmt::print(err, "{} on disk; the new one plays\n", what);
    else
      fmt::print(err, "{} on disk, but the old one plays on: {}\n", what, taken.error().message);
    return taken.ok();
  }

 private:
  Result<void> take_up(Player& player, AuralizerOptions& options) {
    auto opened = BakeFile::open(file_->path(), mix_.access());
    if (!opened.ok()) return opened.error();
    InputFiles inputs;  // were compared with the outputs when the program began
    if (const auto read = mix_.read_script(options, opened->signal_count(), inputs); !read.ok())
      return read;
    auto file = std::make_shared<const BakeFile>(std::move(*opened));
    if (const auto replaced = player.replace(file, options); !replaced.ok()) return replaced;
    file_ = std::move(file);
    watch_.plays(*file_);
    return {};
  }

  std::shared_ptr<const BakeFile> file_;
  BakeFileWatcher watch_;
  const bool follows_;
  const MixArguments& mix_;
};

// Moves and shows until the end, a key or Ctrl-C says stop.
void run(Player& player, const PlayerOptions& options, BakeFollower& follower, PlayHistory& trace,
         std::ostream& err) {
  Terminal terminal;
  const bool live_line = &err == &std::cerr && isatty(STDERR_FILENO) != 0;
  if (terminal.is_terminal() && !options.walk)
    fmt::print(err,
               "arrows or WASD walk and turn, comma and period step aside, R and F rise and "
               "sink, Q ends\n");
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  auto shown = start, glided = start, looked = start;
  KeyedListener keyed(options.listener), wanted = keyed;
  Listener listener = options.listener;
  std::array<float, kMaxChannels> peak{};  // since the last line
  bool told = false;
  DeviceNotices news(err, live_line);
  // JACK's library blocks SIGPIPE, so Interrupt may not hear of it.
  while (!player.finished() && !Interrupt::requested() && !output_reader_is_gone()) {
    // A key ends the wait at once. While the listener glides, the way is cut finely.
    const bool glides = !options.walk && !keyed.is_at(wanted);
    const Key key = terminal.read(glides ? kGlideFrame_ms : kFrame_ms);
    if (key == Key::kQuit) break;
    wanted.apply(key);
    PlayerStatistics status = player.statistics();
    tell_of_failure(status.auralizer.pages, told, err);
    news.tell(status.output);
    tell_of_failure(status.auralizer.sounds, told, err);
    for (std::size_t c = 0; c < peak.size(); ++c)
      peak[c] = std::max(peak[c], status.auralizer.peak[c]);
    if (options.walk) {
      listener = options.walk->at(status.time_s);
    } else {
      const auto now = Clock::now();
      keyed.glide_to(wanted, std::chrono::duration<double>(now - glided).count());
      glided = now;
      listener = keyed.listener();
      player.move(listener);
    }
    trace.add(status, listener);
    const auto now = Clock::now();
    if (now - looked >= kLook) {
      looked = now;
      if (follower.look(player, options.auralizer, err, live_line ? "\r\x1b[K" : "")) told = false;
    }
    if (now - shown <
        (live_line ? std::chrono::milliseconds(100) : std::chrono::milliseconds(1000)))
      continue;
    shown = now;
    std::copy(peak.begin(), peak.end(), status.auralizer.peak);
    peak = {};
    if (live_line) err << to_line_start;
    err << status_line(status, listener, options.auralizer.output.channels());
    if (live_line)
      err << clear_rest_of_line;
    else
      err << '\n';
    err << std::flush;
  }
  if (live_line) err << '\n';
  // What failed since the last look.
  const AuralizerStatistics last = player.statistics().auralizer;
  tell_of_failure(last.pages, told, err);
  tell_of_failure(last.sounds, told, err);
}

}  // namespace

int run_play(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string level, listener, walk_path, format, report_folder;
  bool no_limiter = false, follows = false;
  PlayerOptions options;
  Arguments parser("play",
                   "Plays a bake in real time. In a terminal, arrow keys or WASD walk and turn.",
                   "clamor play hall.clamor --listener 0,1.7,3,180 --voices 2000");
  parser.positional("level", level, "the bake file");
  parser.option(
      "--listener", listener,
      "start at X,Y,Z[,YAW[,PITCH]], metres and degrees; unset: before the first emitter");
  parser.option("--walk", walk_path, "follow a scripted path instead, PATH.json");
  parser.option("--seconds", options.seconds, "how long; 0: until Q, Ctrl-C or the walk's end");
  parser.option("--device", options.device,
                "pulse, jack or alsa; how a name that 'clamor devices' prints begins, or a part of "
                "it; or none");
  parser.option("--rate", options.device_rate_hz,
                "of the device, in Hz; unset: 48000, or what it has. The mix is resampled");
  int frames = 0;
  parser.option("--frames", frames, {16, 8192},
                "frames per block; PulseAudio and ALSA hold four blocks, JACK has its own. Unset: "
                "256, and PulseAudio's buffer grows, up to 0.2 s, where the device runs dry twice "
                "in 30 s");
  const StrategyArguments strategy(parser);
  MixArguments mix(parser);
  parser.flag("--no-limiter", no_limiter, "let peaks clip instead of keeping them below -1 dBFS");
  parser.flag(
      "--follow", follows,
      "when the file is replaced by another bake, fade over to that; unset: say so, and play "
      "the old one to the end");
  parser.option("--record", options.record,
                "also write what is played to this .wav or .flac file, which grows while it plays: "
                "whatever ends the program, a .wav file can be played to its end, a .flac file to "
                "less than a second before; or as WAV to a device or pipe such as /dev/stdout");
  const OutputArguments output_words(parser);
  parser.option("--format", format,
                "of its samples: float, 32, 24 or 16; unset: float, or 24 in a .flac file");
  parser.option("--report", report_folder,
                "at the end, also write loudness, voices and load over time to this folder, as a "
                "page, JSON and CSV; with --record also a spectrogram");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto chosen = strategy.read();
  if (!chosen.ok()) return parser.bad_usage(err, chosen.error().message);
  use(*chosen, options.auralizer);

  if (const auto read = mix.read(options.auralizer); !read.ok())
    return parser.bad_usage(err, read.error().message);
  const auto shape = output_words.read();
  if (!shape.ok()) return parser.bad_usage(err, shape.error().message);
  options.auralizer.output = *shape;
  options.auralizer.limit = !no_limiter;
  options.auralizer.adapt = true;
  options.auralizer.first_sounds_s = kFirstSoundsOfPlayer_s;
  if (!options.record.empty())
    if (const auto right = check_sound_file(options.record, shape->channels()); !right.ok())
      return parser.bad_usage(err, "--record: " + right.error().message);
  const auto samples = sample_format(format, options.record);
  if (!samples.ok()) return parser.bad_usage(err, "--format: " + samples.error().message);
  options.record_format = *samples;
  if (!listener.empty() && !walk_path.empty())
    return parser.bad_usage(err, "give either --listener or --walk");
  if (options.device_rate_hz != 0 &&
      (options.device_rate_hz < 8000 || options.device_rate_hz > 384000))
    return parser.bad_usage(err, "--rate must lie between 8000 and 384000");
  if (!(options.seconds >= 0 && options.seconds <= 864000))
    return parser.bad_usage(err, "--seconds must lie between 0 and 864000");
  if (frames > 0) options.block_frames = frames;
  options.buffer_may_grow = frames == 0;
  options.auralizer.block_frames = options.block_frames;

  const auto fail = [&err](const Error& error) {
    fmt::print(err, "clamor play: {}\n", error.message);
    return kBadInput;
  };
  InputFiles inputs;
  inputs.add(level);
  inputs.add(walk_path);
  auto file = BakeFile::open(level, mix.access());
  if (!file.ok()) return fail(file.error());
  if (const auto read = output_words.read_head(options.auralizer.output, inputs); !read.ok())
    return fail(read.error());
  if (const auto read = mix.read_script(options.auralizer, file->signal_count(), inputs);
      !read.ok())
    return fail(read.error());
  options.listener = before_first_emitter(file->emitters());
  if (!listener.empty()) {
    const auto parsed = parse_listener(listener);
    if (!parsed.ok()) return parser.bad_usage(err, parsed.error().message);
    options.listener = *parsed;
  }
  if (!walk_path.empty()) {
    auto walk = Walk::read(walk_path);
    if (!walk.ok()) return fail(walk.error());
    if (options.seconds == 0) options.seconds = walk->length_s();
    options.walk = std::move(*walk);
  }

  if (!options.record.empty())
    if (const auto target = OutputTarget::find(options.record, inputs); !target.ok())
      return fail(target.error().in("--record"));
  if (!report_folder.empty())
    if (const auto can = PlayHistory::check_folder(report_folder, inputs); !can.ok())
      return fail(can.error().in("--report"));

  if (!options.auralizer.script)
    if (const auto warning = audibility_warning(
            *file, options.walk.value_or(Walk::standing(options.listener)),
            {.seconds = options.seconds, .with_occlusion = options.auralizer.visibility}))
      fmt::print(err, "warning: {}\n", *warning);
  const Interrupt interrupt;
  const auto playing = std::make_shared<const BakeFile>(std::move(file));
  BakeFollower follower(playing, request.follows, mix);
  auto player = Player::create(playing, options);
  if (!player.ok()) return player.error();
  fmt::print(err, "playing {} on {}\n", request.level, describe((*player)->statistics().output));
  if (!output_note.empty()) fmt::print(err, "{}\n", output_note);
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
  Arguments parser("play",
                   "Plays a bake in real time. In a terminal, the arrow keys or WASD walk and "
                   "turn.",
                   "clamor play hall.clamor --listener 0,1.7,3,180 --voices 2000");
  request.add_options(parser);
  const StrategyArguments strategy(parser);
  const MixArguments mix(parser);
  request.add_output_options(parser);
  const OutputArguments output(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (const auto right = interpret(request, strategy, mix, output); !right.ok())
    return parser.bad_usage(err, right.error().message);

  const auto fail = [&err](const Error& error) {
    fmt::print(err, "clamor play: {}\n", error.message);
    return kBadInput;
  };
  auto file = read_inputs(request, mix, output);
  if (!file.ok()) return fail(file.error());
  const PlayerOptions& options = request.options;
  if (!options.auralizer.script)
    if (const auto warning = audibility_warning(
            *file, options.walk.value_or(Walk::standing(options.pose)),
            {.seconds = options.seconds, .with_occlusion = options.auralizer.visibility}))
      fmt::print(err, "warning: {}\n", *warning);
  if (const auto played = play(request, std::move(*file), mix, output.default_output_note(), err);
      !played.ok())
    return fail(played.error());
  return kSuccess;
}

}  // namespace clamor
