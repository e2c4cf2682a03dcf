#include "runtime/world/world.h"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <new>
#include <utility>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/level/emitter.h"
#include "runtime/hrtf/hrtf.h"

namespace clamor {

namespace {

constexpr auto kSamplerNap = std::chrono::milliseconds(1);

// Distinguishes the worlds of the process; numbers return after 4096 worlds.
std::uint64_t next_number() {
  static constinit std::atomic<std::uint64_t> next{0};
  return next.fetch_add(1, std::memory_order_relaxed);
}

std::uint64_t tag_of(std::uint64_t world, std::uint64_t table) { return world << 3 | table; }

}  // namespace

World::World(const Options& options)
    : own_thread_(options.own_thread),
      report_(options.report),
      number_(next_number()),
      levels_(kMaxLevels, tag_of(number_, 0)),
      sources_(options.max_sources, options.max_sounds, tag_of(number_, 2)),
      listeners_(kMaxListeners, tag_of(number_, 1)) {
  if (!own_thread_) return;
  sampler_ = std::jthread([this, hooks = options.thread_hooks](const std::stop_token& stop) {
    const HookedThread hooked(hooks, "sampler");
    make_keyframes(stop);
  });
}

void World::make_keyframes(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::size_t made = 0;
    try {
      for (const auto& listener : present()) made += make_keyframes(*listener);
    } catch (const std::bad_alloc&) {  // there is no memory to list the listeners
    }
    if (made == 0) std::this_thread::sleep_for(kSamplerNap);
  }
}

// An exception, such as std::bad_alloc, costs a keyframe and not the process. It is reported once
// until a keyframe is made again.
std::size_t World::make_keyframes(WorldListener& listener) {
  try {
    const bool made = listener.make_keyframes();
    fails_ = fails_ && !made;
    return made;
  } catch (const std::exception& thrown) {
    if (report_ && !fails_) {
      std::array<char, 256> sentence;  // without an allocation
      std::snprintf(sentence.data(), sentence.size(), "A keyframe could not be made: %s",
                    thrown.what());
      report_(sentence.data());
    }
    fails_ = true;
    return 0;
  }
}

World::~World() = default;

std::uint64_t World::add_level(std::shared_ptr<const BakeFile> file) {
  const std::lock_guard lock(tables_);
  return levels_.insert(std::move(file));
}

std::uint64_t World::add_listener(std::shared_ptr<WorldListener> listener) {
  const std::lock_guard lock(tables_);
  return listeners_.insert(std::move(listener));
}

std::shared_ptr<const BakeFile> World::level(std::uint64_t handle) const {
  const std::lock_guard lock(tables_);
  return levels_.find(handle);
}

std::shared_ptr<WorldListener> World::listener(std::uint64_t handle) const {
  const std::lock_guard lock(tables_);
  return listeners_.find(handle);
}

// The object is freed after the lock, because the application's release callback may call back.
template <class T>
bool World::remove(HandleTable<T>& table, std::uint64_t handle) {
  std::shared_ptr<T> removed;
  const std::lock_guard lock(tables_);
  removed = table.remove(handle);
  return removed != nullptr;
}

bool World::remove_level(std::uint64_t handle) {
  if (!remove(levels_, handle)) return false;
  sources_.forget_level(handle);
  return true;
}

// The lock keeps the level open meanwhile.
bool World::change_emitter(std::uint64_t level, std::size_t emitter, const WorldEmitter& changed) {
  const std::lock_guard lock(tables_);
  const auto file = levels_.find(level);
  if (file == nullptr) return false;
  sources_.change_emitter(level, emitter, file->emitters().size(), changed);
  return true;
}

bool World::set_portal(std::uint64_t level, std::size_t portal, double openness) {
  const std::lock_guard lock(tables_);
  const auto file = levels_.find(level);
  if (file == nullptr) return false;
  sources_.set_portal(level, portal, file->portals().portals.size(), openness);
  return true;
}

bool World::remove_listener(std::uint64_t handle) { return remove(listeners_, handle); }

std::vector<std::shared_ptr<WorldListener>> World::present() const {
  std::vector<std::shared_ptr<WorldListener>> listeners;
  const std::lock_guard lock(tables_);
  listeners_.for_each([&](const auto& listener) { listeners.push_back(listener); });
  return listeners;
}

std::size_t World::update(double loading_s) {
  const auto listeners = present();
  std::size_t made = 0;
  for (const auto& listener : listeners) made += listener->make_keyframes();
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(loading_s);
  for (bool loaded = true; loaded;) {
    loaded = false;
    for (const auto& listener : listeners) loaded = listener->load() || loaded;
    if (Clock::now() >= end) break;
  }
  return made;
}

void World::prepare(WorldSound& sound) const {
  for (const auto& listener : present()) (void)sound.for_mode(listener->mode());
}

Result<std::shared_ptr<const Hrtf>> World::head(const std::string& sofa) {
  const std::lock_guard lock(heads_mutex_);
  if (const auto found = heads_.find(sofa); found != heads_.end()) return found->second;
  auto read = Hrtf::read(sofa, own_thread_ ? 0 : 1);
  if (read.ok()) heads_[sofa] = *read;
  return read;
}

}  // namespace clamor
