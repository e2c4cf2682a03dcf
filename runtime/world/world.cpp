#include "runtime/world/world.h"

#include <chrono>
#include <utility>

#include "formats/bake_file/bake_file.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

namespace {

constexpr auto kSamplerNap = std::chrono::milliseconds(1);

// Distinguishes the tables of all worlds of the process, as long as no 16 bits are alike by chance.
std::uint64_t tag_of(const World* world, std::uint64_t table) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
  std::uint64_t mixed = reinterpret_cast<std::uintptr_t>(world) ^ static_cast<std::uint64_t>(now);
  mixed = (mixed ^ (mixed >> 33)) * 0xff51afd7ed558ccdu;
  return ((mixed >> 40) << 3 | table) & 0xffff;
}

}  // namespace

World::World(bool own_thread, std::size_t max_sources, std::size_t max_sounds)
    : own_thread_(own_thread),
      levels_(kMaxLevels, tag_of(this, 0)),
      sources_(max_sources, max_sounds, tag_of(this, 2)),
      listeners_(kMaxListeners, tag_of(this, 1)) {
  if (!own_thread) return;
  sampler_ = std::jthread([this](const std::stop_token& stop) {
    name_thread("sampler");
    while (!stop.stop_requested())
      if (update(0) == 0) std::this_thread::sleep_for(kSamplerNap);
  });
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

bool World::remove_level(std::uint64_t handle) { return remove(levels_, handle); }

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
  if (own_thread_) return made;
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
