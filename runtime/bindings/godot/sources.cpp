#include "runtime/bindings/godot/sources.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "runtime/bindings/godot/world.h"

namespace clamor::godot {
namespace {

constexpr double kMaxShared_s = 10;
constexpr double kKept_s = 10;                // how long a sound is kept that nobody plays
constexpr std::uint64_t kResampled = 512;     // frames that a resampler of Godot's may hold
constexpr std::uint64_t kResamplerDelay = 2;  // frames by which Godot's resampler is late
constexpr double kTail_s = 3;                 // how long a source may die away
constexpr double kStreamLatency_s = 0.1;      // between pulling a sound and hearing it

// `frames` of a playback, or fewer, mixed to mono.
std::vector<float> pulled(const Value& playback, double pitch, Integer frames) {
  std::vector<float> block =
      playback.call("mix_audio", {pitch, frames}).to_floats(kPackedVector2Array, 2);
  for (std::size_t i = 0; i < block.size() / 2; ++i)
    block[i] = 0.5f * (block[2 * i] + block[2 * i + 1]);
  block.resize(block.size() / 2);
  return block;
}

// Fills a source's stream, on the thread that makes keyframes.
std::uint32_t pull_stream(void* user, float* samples, std::uint32_t frames) {
  auto& streamed = **static_cast<std::shared_ptr<StreamedSound>*>(user);
  std::uint32_t mixed = 0;
  if (streamed.ended == 0) {
    const std::vector<float> block = pulled(streamed.playback, streamed.pitch, frames);
    mixed = std::min(frames, std::uint32_t(block.size()));
    std::copy_n(block.begin(), mixed, samples);
    // A stream has ended some time before what its resampler has taken of it.
    if (streamed.playback.call("is_playing").to_bool())
      streamed.playing_until = streamed.pulled + frames;
    else if (mixed < frames || streamed.pulled + frames >= streamed.playing_until + kResampled)
      streamed.ended = streamed.pulled + std::max(mixed, 1u);
  }
  streamed.pulled += frames;
  return mixed;
}

void add_stream(const World& world, const std::shared_ptr<StreamedSound>& streamed,
                clamor_result& result) {
  auto stream = sized<clamor_stream>();
  stream.rate_hz = std::uint32_t(world.rate_hz());
  auto* kept = new std::shared_ptr<StreamedSound>(streamed);
  stream.user = kept;
  stream.pull = pull_stream;
  stream.release = [](void* user) { delete static_cast<std::shared_ptr<StreamedSound>*>(user); };
  result = clamor_add_stream(world.context(), &stream, &streamed->handle, nullptr);
  if (result != CLAMOR_OK) delete kept;
}

Value property(const Value& object, const char* name) { return object.call("get", {name}); }

// Whether a stream is the same each time that it is played, and as a whole where it loops.
bool may_share(const Value& stream, bool& loops) {
  const std::string type = stream.call("get_class").to_text();
  const double length_s = stream.call("get_length").to_float();
  if (length_s <= 0 || length_s > kMaxShared_s) return false;
  if (type == "AudioStreamWAV") {
    const Integer mode = property(stream, "loop_mode").to_int();
    loops = mode != 0;
    const double end_s = double(property(stream, "loop_end").to_int()) /
                         double(property(stream, "mix_rate").to_int());
    return mode == 0 || (mode == 1 && property(stream, "loop_begin").to_int() == 0 &&
                         std::abs(end_s - length_s) < 1e-4);
  }
  if (type != "AudioStreamOggVorbis" && type != "AudioStreamMP3") return false;
  loops = property(stream, "loop").to_bool();
  return !loops || (property(stream, "loop_offset").to_float() == 0 &&
                    property(stream, "beat_count").to_int() == 0);
}

// Decodes a stream as Godot plays it.
void decode(const World& world, const Value& stream, SharedSound& sound) {
  const Value playback = stream.call("instantiate_playback");
  playback.call("start", {0.0});
  const auto frames = std::size_t(std::llround(sound.length_s * world.rate_hz()));
  std::vector<float> samples;
  while (samples.size() < frames + kResamplerDelay) {
    const std::vector<float> block =
        pulled(playback, 1,
               Integer(std::min(frames + kResamplerDelay - samples.size(), std::size_t{8192})));
    if (block.empty()) break;
    samples.insert(samples.end(), block.begin(), block.end());
  }
  samples.resize(frames + kResamplerDelay);
  auto options = sized<clamor_sound_options>();
  options.rate_hz = std::uint32_t(world.rate_hz());
  options.loops = sound.loops;
  sound.result = clamor_add_sound(world.context(), samples.data() + kResamplerDelay, frames,
                                  &options, &sound.handle, nullptr);
}

void read_options(const Value& values, clamor_group paused, clamor_source_options& into) {
  const double gain = values["gain"].to_float();
  into.gain = gain > 0 ? gain : 1;
  std::fill_n(into.band_gains, 8, gain > 0 ? 1.0 : 0.0);
  if (gain <= 0) into.band_gains[0] = 1e-9;  // zeros everywhere would mean ones
  std::fill_n(into.directivity, 8, values["directivity"].to_float());
  into.has_reverberation = 1;
  into.reverberation = values["reverberation"].to_float();
  into.group = values["paused"].to_bool() ? paused : 0;
}

bool moves(const clamor_motion& motion) {
  return std::any_of(motion.velocity_mps, motion.velocity_mps + 3, [](double v) { return v != 0; });
}

void rotate(const Transform& by, const Vector3& v, double* to) {
  for (int i = 0; i < 3; ++i)
    to[i] = double(by.rows[i].x) * v.x + double(by.rows[i].y) * v.y + double(by.rows[i].z) * v.z;
}

}  // namespace

std::shared_ptr<Voice> GameSources::voice(Integer number) const {
  const auto it = std::ranges::lower_bound(voices_, number, {}, &Voice::number);
  return it == voices_.end() || (*it)->number != number ? nullptr : *it;
}

Integer GameSources::play(Object node, const Value& stream, const Value& values, double from_s) {
  if (!world_.open()) return 0;
  const auto played = std::make_shared<Voice>();
  played->node = node;
  played->stream = stream;
  played->options = sized<clamor_source_options>();
  read_options(values, world_.paused(), played->options);
  begin(*played, from_s, values["pitch"].to_float());
  const Integer number = played->number = ++last_;
  voices_.push_back(played);
  // The next keyframe may be made before this frame ends, however fast the machine is.
  if (world_.is_offline()) frame(0, 0);
  return number;
}

void GameSources::begin(Voice& begun, double from_s, double pitch) {
  begun.played_s = begun.options.played_s = from_s;
  begun.shared = pitch == 1 ? shared_sound(begun.stream) : nullptr;
  if (begun.shared != nullptr) return;
  begun.options.played_s = 0;
  begun.streamed = std::make_shared<StreamedSound>();
  begun.streamed->pitch = pitch;
  begun.streamed->playback = begun.stream.call("instantiate_playback");
  begun.streamed->playback.call("start", {from_s});
}

std::shared_ptr<SharedSound> GameSources::shared_sound(const Value& stream) {
  bool loops = false;
  if (!may_share(stream, loops)) return nullptr;
  auto& sound = sounds_[{stream.call("get_instance_id").to_int(), loops}];
  if (sound != nullptr) return sound;
  sound = std::make_shared<SharedSound>();
  sound->length_s = stream.call("get_length").to_float();
  sound->loops = loops;
  sound->used_s = now_s_;
  world_.loader().run([this, sound, stream] { decode(world_, stream, *sound); });
  return sound;
}

void GameSources::change(Integer number, const Value& values) {
  const auto changed = voice(number);
  if (changed == nullptr || changed->is_over) return;
  read_options(values, world_.paused(), changed->options);
  changed->is_changed = true;
  const double pitch = values["pitch"].to_float();
  if (changed->streamed != nullptr)
    changed->streamed->pitch = pitch;
  else if (pitch != 1)
    begin(*changed, position_s(number), pitch);
}

void GameSources::stop(Integer number) {
  const auto stopped = voice(number);
  if (stopped == nullptr) return;
  stopped->node = nullptr;
  if (stopped->is_over) return;
  stopped->is_over = stopped->is_stopped = true;
  stopped->over_s = now_s_;
}

double GameSources::position_s(Integer number) const {
  const auto played = voice(number);
  if (played == nullptr) return 0;
  if (played->streamed != nullptr)
    return played->streamed->playback.call("get_playback_position").to_float();
  const double length_s = played->shared->length_s;
  return played->shared->loops ? std::fmod(played->played_s, length_s)
                               : std::min(played->played_s, length_s);
}

void GameSources::set_origin(const Transform& origin) {
  has_new_origin_ = has_new_origin_ || std::memcmp(&origin, &origin_, sizeof(origin)) != 0;
  origin_ = origin;
}

void GameSources::frame(double elapsed_s, double moved_s) {
  now_s_ += elapsed_s;
  std::vector<Integer> ended;
  const bool may_publish = !is_publishing_;
  std::erase_if(voices_, [&](const std::shared_ptr<Voice>& played) {
    advance(*played, elapsed_s);
    if (played->is_over && played->node != nullptr) ended.push_back(played->number);
    if (played->node != nullptr && !played->is_over) follow(*played, moved_s);
    return may_publish && publish(played);
  });
  has_new_origin_ = false;
  if (may_publish) {
    is_publishing_ = true;
    world_.publisher().run([this] {
      for (Change& change : changes_) apply(change);
      changes_.clear();
      if (!world_.is_offline()) clamor_commit(world_.context(), 0);
      is_publishing_ = false;
    });
  }
  if (world_.is_offline() && moved_s > 0) {
    const std::lock_guard lock(moving_on_);
    moving_.clear();
    for (const auto& moved : voices_)
      if (!moved->is_over && moves(moved->options.motion))
        moving_.emplace_back(moved->source, moved->options.motion);
  }
  if (now_s_ > looked_s_ + 1) forget_unused();
  for (const Integer number : ended) {
    // The game's answer to the end of a sound may have freed another node.
    const auto over = voice(number);
    if (over == nullptr || over->node == nullptr) continue;
    Value(std::exchange(over->node, nullptr)).call("_on_ended", {number});
  }
}

void GameSources::move_on(double later_s) {
  const std::lock_guard lock(moving_on_);
  for (auto [source, motion] : moving_) {
    for (int i = 0; i < 3; ++i) motion.position_m[i] += later_s * motion.velocity_mps[i];
    clamor_move_source(world_.context(), source, &motion);
  }
}

void GameSources::clear() {
  voices_.clear();
  sounds_.clear();
}

// Finds out whether the sound has ended.
void GameSources::advance(Voice& played, double elapsed_s) {
  if (played.is_over) return;
  bool has_ended = false;
  if (played.streamed != nullptr) {
    const auto& streamed = *played.streamed;
    has_ended = streamed.ended != 0 &&
                double(streamed.pulled - streamed.ended) > kStreamLatency_s * world_.rate_hz();
  } else {
    if (played.is_added && played.options.group == 0) played.played_s += elapsed_s;
    has_ended = !played.shared->loops && played.played_s >= played.shared->length_s;
    if (played.shared->result < 0) played.result = played.shared->result.load();
  }
  if (const clamor_result result = played.result; result < 0) {
    world_.report(Value(played.node).call("get_path").to_text(),
                  std::string("the source cannot play: ") + clamor_result_text(result));
    has_ended = true;
  }
  if (has_ended) played.is_over = true, played.over_s = now_s_;
}

void GameSources::follow(Voice& moved, double moved_s) const {
  // Where a node was before its first frame tells no velocity: it may have been put elsewhere
  // since.
  const bool had_frame = std::exchange(moved.has_frame, moved.has_frame || moved_s > 0);
  const Transform place = global_transform(moved.node);
  clamor_motion& motion = moved.options.motion;
  if (!has_new_origin_ && !moves(motion) && std::memcmp(&place, &moved.place, sizeof(place)) == 0)
    return;
  moved.place = place;
  moved.has_moved = true;
  const clamor_motion before = motion;
  rotate(origin_, place.origin, motion.position_m);
  motion.position_m[0] += origin_.origin.x;
  motion.position_m[1] += origin_.origin.y;
  motion.position_m[2] += origin_.origin.z;
  rotate(origin_, {-place.rows[0].z, -place.rows[1].z, -place.rows[2].z}, motion.axis);
  if (!world_.is_offline() || !had_frame || moved_s <= 0) return;
  velocity_between(before.position_m, motion.position_m, moved_s, motion.velocity_mps);
}

// Appends what the publisher must do; true if nothing is left to be done for the voice.
bool GameSources::publish(const std::shared_ptr<Voice>& published) {
  Voice& v = *published;
  const auto append = [&](Kind kind) {
    changes_.push_back({kind, published, v.shared, v.streamed, v.options});
  };
  if (!v.is_added) {
    if (v.is_over) return true;
    if (v.shared != nullptr && v.shared->result == 1) return false;
    append(Kind::kAdd);
    v.is_added = true;
  } else if (v.is_over) {
    if (std::exchange(v.is_stopped, false)) append(Kind::kStop);
    if (now_s_ < v.over_s + kTail_s) return false;
    append(Kind::kFree);
    return true;
  } else if (v.is_changed) {
    append(Kind::kChange);
  } else if (v.has_moved && !(world_.is_offline() && moves(v.options.motion))) {
    append(Kind::kMove);  // others are moved for each keyframe
  }
  v.is_changed = v.has_moved = false;
  return false;
}

// On the publisher's thread.
void GameSources::apply(Change& change) const {
  auto* const context = world_.context();
  Voice& v = *change.voice;
  switch (change.kind) {
    case Kind::kAdd:
    case Kind::kChange: {
      clamor_result result = CLAMOR_OK;
      if (change.streamed != nullptr && change.streamed->handle == 0)
        add_stream(world_, change.streamed, result);
      change.options.sound =
          change.streamed != nullptr ? change.streamed->handle : change.shared->handle;
      if (result == CLAMOR_OK)
        result = change.kind == Kind::kAdd
                     ? clamor_add_source(context, &change.options, &v.source)
                     : clamor_change_source(context, v.source, &change.options);
      v.result = result;
      break;
    }
    case Kind::kMove:
      clamor_move_source(context, v.source, &change.options.motion);
      break;
    case Kind::kStop:
      clamor_remove_source(context, v.source);
      break;
    case Kind::kFree:
      clamor_remove_source(context, v.source);
      if (change.streamed != nullptr) clamor_remove_sound(context, change.streamed->handle);
  }
}

void GameSources::forget_unused() {
  looked_s_ = now_s_;
  for (auto it = sounds_.begin(); it != sounds_.end();) {
    const auto sound = it->second;
    const bool is_used = sound.use_count() > 2;  // by somebody but the map and this function
    if (is_used) sound->used_s = now_s_;
    const bool is_gone =
        engine.object_get_instance_from_id(std::uint64_t(it->first.first)) == nullptr;
    if (is_used || (!is_gone && now_s_ < sound->used_s + kKept_s)) {
      ++it;
      continue;
    }
    world_.publisher().run([this, sound] { clamor_remove_sound(world_.context(), sound->handle); });
    it = sounds_.erase(it);
  }
}

}  // namespace clamor::godot
