#include "runtime/bindings/godot/world.h"

#include <algorithm>
#include <thread>
#include <utility>

namespace clamor::godot {
namespace {

constexpr std::size_t kMaxBlock_frames = 4096;  // Godot's are of 512
constexpr double kMaxSpeed_mps = 150;
constexpr double kLead_s = 0.1;      // by which keyframes are made ahead of the sound, offline
constexpr double kMaxLater_s = 0.1;  // between a frame and the keyframes that have its places

template <class T>
std::shared_ptr<T> found(const std::map<Integer, std::shared_ptr<T>>& map, Integer number) {
  const auto it = map.find(number);
  return it == map.end() ? nullptr : it->second;
}

// A bake that Godot reads: a file, or part of an exported game's archive.
struct ArchivedBake {
  std::mutex reading;
  Value file;
};

std::int32_t read_bake(void* user, std::uint64_t offset, std::uint64_t count, void* into) {
  auto& bake = *static_cast<ArchivedBake*>(user);
  const std::lock_guard lock(bake.reading);
  bake.file.call("seek", {Integer(offset)});
  const auto read =
      engine.file_access_get_buffer(bake.file.to_object(), static_cast<std::uint8_t*>(into), count);
  return read == count ? 0 : 1;
}

// So that the main thread need not ask the library, which may make it wait.
void read_names(const World& world, Level& level) {
  auto info = sized<clamor_level_info>();
  clamor_get_level_info(world.context(), level.handle, &info);
  level.sources = info.sources;
  for (std::uint32_t i = 0; i < info.emitters; ++i) {
    auto emitter = sized<clamor_emitter_info>();
    clamor_get_emitter_info(world.context(), level.handle, i, &emitter);
    level.emitters.emplace_back(emitter.name);
  }
  for (std::uint32_t i = 0; i < info.portals; ++i) {
    auto portal = sized<clamor_portal_info>();
    clamor_get_portal_info(world.context(), level.handle, i, &portal);
    level.portals.emplace_back(portal.name);
  }
  for (std::uint32_t i = 0; i < info.parts; ++i) {
    clamor_part handle = 0;
    auto part = sized<clamor_part_info>();
    clamor_get_level_part(world.context(), level.handle, i, &handle);
    clamor_get_part_info(world.context(), handle, &part);
    level.parts.emplace_back(part.name);
    level.part_handles.push_back(handle);
  }
}

void copy(const Vector3& from, double* to) { to[0] = from.x, to[1] = from.y, to[2] = from.z; }

}  // namespace

void velocity_between(const double* from_m, const double* to_m, double seconds, double* mps) {
  double squared = 0;
  for (int i = 0; i < 3; ++i) {
    mps[i] = (to_m[i] - from_m[i]) / seconds;
    squared += mps[i] * mps[i];
  }
  if (!(squared <= kMaxSpeed_mps * kMaxSpeed_mps)) std::fill_n(mps, 3, 0.0);
}

clamor_pose pose_of(const Value& position, const Value& rotation) {
  clamor_pose pose{};
  copy(position.to_vector(), pose.position_m);
  const Quaternion turned = rotation.to_quaternion();
  pose.orientation[0] = turned.x, pose.orientation[1] = turned.y;
  pose.orientation[2] = turned.z, pose.orientation[3] = turned.w;
  return pose;
}

World& World::get() {
  static auto* world = new World;  // Godot's audio thread outlives static objects
  return *world;
}

bool World::open() {
  if (context_ != nullptr) return true;
  const Value settings = Value::singleton("ProjectSettings");
  is_offline_ = Value::singleton("OS").call("has_feature", {"movie"}).to_bool() ||
                settings.call("get_setting", {"audio/clamor/offline", false}).to_bool();
  rate_hz_ = Value::singleton("AudioServer").call("get_mix_rate").to_float();
  auto options = sized<clamor_options>();
  options.caller_updates = is_offline_;
  options.max_sources = 4096;
  options.max_sounds = 4096;
  options.user = this;
  options.log = [](void* user, const char* sentence) {
    static_cast<World*>(user)->report("", sentence);
  };
  clamor_error error;
  if (clamor_create(&options, &context_, &error) != CLAMOR_OK) {
    report("", error.sentence);
    return false;
  }
  auto group = sized<clamor_group_options>();
  group.is_paused = 1;
  clamor_add_group(context_, &group, &paused_);
  at_ = std::chrono::steady_clock::now();
  if (!is_offline_) loader_.begin(), publisher_.begin();
  return true;
}

void World::close() {
  if (context_ == nullptr) return;
  while (!listeners_.empty()) free_listener(listeners_.begin()->first);
  loader_.end();
  publisher_.end();
  levels_.clear();
  parts_.clear();
  sources_.clear();
  clamor_destroy(context_);
  context_ = nullptr;
}

void World::report(const std::string& node, const std::string& sentence) const {
  const std::string text = node.empty() ? "Clamor: " + sentence : node + ": " + sentence;
  engine.print_error(text.c_str(), "clamor", "clamor", 0, 1);
}

Integer World::open_level(const Value& file, const std::string& path, const std::string& node) {
  if (!open()) return 0;
  const auto level = std::make_shared<Level>();
  level->node = node;
  levels_[++last_] = level;
  loader_.run([this, level, file, path] {
    if (level->is_closed) return;
    auto* bake = new ArchivedBake;
    bake->file = file;
    auto reader = sized<clamor_reader>();
    const std::string name = level->node + " (" + path + ")";  // in all sentences about the level
    reader.name = name.c_str();
    reader.size = std::uint64_t(file.call("get_length").to_int());
    reader.user = bake;
    reader.read = read_bake;
    reader.release = [](void* user) { delete static_cast<ArchivedBake*>(user); };
    clamor_error error;
    if (clamor_open_level_with(context_, &reader, &level->handle, &error) == CLAMOR_OK) {
      read_names(*this, *level);
      level->state = kOpen;
    } else {
      delete bake;
      level->state = kFailed;
      report("", error.sentence);
    }
  });
  return last_;
}

void World::close_level(Integer number) {
  const auto closed = level(number);
  if (closed == nullptr) return;
  levels_.erase(number);
  closed->is_closed = true;
  loader_.run([this, closed] { clamor_close_level(context_, closed->handle); });
}

std::shared_ptr<Level> World::level(Integer number) const { return found(levels_, number); }

std::shared_ptr<Listener> World::listener(Integer number) const {
  return found(listeners_, number);
}

Integer World::create_listener(Integer level_number, const Value& values, const std::string& node) {
  const auto first = level(level_number);
  if (first == nullptr) return 0;
  const auto created = std::make_shared<Listener>();
  created->node = node;
  created->pose = pose_of(values["position"], values["rotation"]);
  listeners_[++last_] = created;
  auto options = sized<clamor_listener_options>();
  options.output = std::uint32_t(values["output"].to_int());
  options.voices = std::uint32_t(values["voices"].to_int());
  options.limits = values["limiter"].to_bool();
  options.reports_voices = values["reports_voices"].to_bool();
  options.gain = values["gain"].to_float();
  const std::string layout = values["layout"].to_text();
  if (layout == "5.1" || layout == "7.1") {
    created->channels = layout == "5.1" ? 6 : 8;
    created->block.resize(kMaxBlock_frames * std::size_t(created->channels));
  }
  options.rate_hz = std::uint32_t(rate_hz_);
  options.offline = is_offline_;
  const std::string sofa = values["sofa"].to_text();
  loader_.run([this, first, created, options, sofa, layout]() mutable {
    if (first->state != kOpen || created->is_freed) return;  // what opened it has said why
    {
      const std::lock_guard lock(created->rendering);
      options.pose = created->pose;
    }
    if (!sofa.empty()) options.sofa = sofa.c_str();
    options.layout = layout.c_str();
    clamor_listener handle = 0;
    clamor_error error;
    if (clamor_create_listener(context_, first->handle, &options, &handle, &error) != CLAMOR_OK)
      return report(created->node, error.sentence);
    const std::lock_guard lock(created->rendering);
    created->handle = handle;
    created->known = handle;
  });
  return last_;
}

void World::enter_level(Integer listener_number, Integer level_number) {
  const auto entering = listener(listener_number);
  const auto next = level(level_number);
  if (entering == nullptr || next == nullptr) return;
  loader_.run([this, entering, next] {
    clamor_error error;
    if (next->state == kOpen && entering->known != 0 &&
        clamor_enter_level(context_, entering->known, next->handle, &error) != CLAMOR_OK)
      report(entering->node, error.sentence);
  });
}

void World::free_listener(Integer number) {
  const auto leaving = listener(number);
  if (leaving == nullptr) return;
  listeners_.erase(number);
  leaving->leaves = leaving->is_freed = true;
  loader_.run([this, leaving] {
    // The next block fades out; where none is mixed any more, nothing is heard anyway.
    for (int i = 0; i < 5 && !is_offline_ && leaving->leaves && leaving->known != 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    clamor_listener handle = 0;
    {
      const std::lock_guard lock(leaving->rendering);
      std::swap(handle, leaving->handle);
      leaving->known = 0;
    }
    if (handle != 0) clamor_destroy_listener(context_, handle);
  });
}

void World::move_listener(Integer number, const Value& position, const Value& rotation) {
  const auto moved = listener(number);
  if (moved == nullptr) return;
  const clamor_pose pose = pose_of(position, rotation);
  if (const clamor_listener handle = moved->known; handle != 0 && !is_offline_) {
    publisher_.run([this, handle, pose] { clamor_move_listener(context_, handle, &pose); });
  } else {
    const double seconds = is_offline_ ? moved_s() : 0;
    const std::lock_guard lock(moved->rendering);
    if (seconds > 0)
      velocity_between(moved->pose.position_m, pose.position_m, seconds, moved->velocity_mps);
    moved->pose = pose;
  }
}

Integer World::keep_part(clamor_part handle) {
  parts_[++last_] = std::make_shared<clamor_part>(handle);
  return last_;
}

void World::change_part(Integer number, std::function<void(clamor_part&)> change) {
  if (const auto part = found(parts_, number))
    publisher_.run([part, change = std::move(change)] { change(*part); });
}

void World::remove_part(Integer number) {
  change_part(number, [this](clamor_part& handle) { clamor_remove_part(context_, handle); });
  parts_.erase(number);
}

// The time that sounds have played since the last call. Each listener counts its frames.
double World::elapsed_s() {
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t frames = mixed_frames_;
  const double played_s = double(frames - std::exchange(at_frames_, frames)) / rate_hz_ /
                          double(std::max<std::size_t>(listeners_.size(), 1));
  const std::chrono::duration<double> passed = now - std::exchange(at_, now);
  return is_offline_ ? played_s : passed.count();
}

// How long the game's last frame was, offline.
double World::moved_s() const {
  const Value tree = Value::singleton("Engine").call("get_main_loop");
  return tree.call("get_root").call("get_process_delta_time").to_float();
}

void World::frame() {
  if (context_ == nullptr) return;
  const double frame_s = is_offline_ ? moved_s() : 0;
  frame_s_ = frame_s_ + frame_s;
  sources_.frame(elapsed_s(), frame_s);
  for (const auto& [number, listener] : listeners_)
    publisher_.run([this, listener] { read_statistics(*listener); });
}

void World::read_statistics(Listener& listener) const {
  auto statistics = sized<clamor_listener_statistics>();
  if (clamor_get_listener_statistics(context_, listener.known, &statistics) != CLAMOR_OK) return;
  const std::lock_guard lock(listener.telling);
  listener.statistics = statistics;
}

void World::make_keyframes(Listener& offline) {
  for (;;) {
    std::uint32_t wanted = 0, made = 0;
    double time_s = 0;
    if (clamor_next_keyframe(context_, offline.handle, &wanted, &time_s) != CLAMOR_OK ||
        wanted == 0)
      return;
    if (offline.began_s < 0) offline.began_s = frame_s_ - time_s;
    const double later_s =
        std::clamp(offline.began_s + time_s - kLead_s - frame_s_, -kMaxLater_s, kMaxLater_s);
    clamor_pose pose = offline.pose;
    for (int i = 0; i < 3; ++i) pose.position_m[i] += later_s * offline.velocity_mps[i];
    clamor_move_listener(context_, offline.handle, &pose);
    sources_.move_on(later_s);
    clamor_commit(context_, time_s);
    if (clamor_update(context_, 0, &made) != CLAMOR_OK) return;
  }
}

void World::mix(Listener& heard, float* frames, int count) {
  const auto begin = std::chrono::steady_clock::now();
  const int channels = heard.channels;
  float* const mixed = channels == 2 ? frames : heard.block.data();
  const bool fits = channels == 2 || count <= int(kMaxBlock_frames);
  std::unique_lock lock(heard.rendering, std::defer_lock);
  if (is_offline_)
    lock.lock();
  else
    (void)lock.try_lock();
  bool is_rendered = false;
  if (fits && lock.owns_lock() && heard.handle != 0 && heard.gain != 0) {
    if (is_offline_) make_keyframes(heard);
    is_rendered = clamor_render(context_, heard.handle, mixed, std::uint32_t(count)) == CLAMOR_OK;
  }
  if (!is_rendered || channels != 2) std::fill_n(frames, 2 * count, 0.0f);
  if (heard.leaves && is_rendered) {
    const float step = heard.gain / float(count);
    for (int i = 0; i < count; ++i)
      for (int channel = 0; channel < channels; ++channel)
        mixed[channels * i + channel] *= heard.gain - step * float(i + 1);
  }
  if (heard.leaves) {
    heard.gain = 0;
    heard.leaves = false;
  }
  heard.untaken = is_rendered ? ~0u : 0;
  mixed_frames_ += std::uint64_t(count);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  heard.load = 0.95 * heard.load + 0.05 * taken.count() * rate_hz_ / count;
}

void World::take_pair(Listener& heard, int pair, float* frames, int count) {
  const bool is_there = (heard.untaken >> pair & 1u) != 0 && 2 * pair < heard.channels;
  heard.untaken &= ~(1u << pair);
  for (int i = 0; i < count; ++i)
    for (int channel = 0; channel < 2; ++channel)
      frames[2 * i + channel] =
          is_there ? heard.block[std::size_t(heard.channels * i + 2 * pair + channel)] : 0;
}

}  // namespace clamor::godot
