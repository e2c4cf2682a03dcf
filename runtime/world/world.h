// world.h: the levels that an application has opened and the listeners in them, with the thread
// that makes their keyframes.
//
// Threads: all functions on any, except where noted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/result.h"
#include "runtime/realtime/thread_hooks.h"
#include "runtime/world/handle_table.h"
#include "runtime/world/world_listener.h"
#include "runtime/world/world_sources.h"

namespace clamor {

class BakeFile;
class Hrtf;

class World {
 public:
  static constexpr std::size_t kMaxLevels = 256, kMaxListeners = 64;

  // Receives failures that no function can return; may be empty. Any thread but the audio thread
  // calls it, several at a time.
  using Report = std::function<void(const char* sentence)>;

  struct Options {
    // Keyframes are made on a thread of the world's. Otherwise the caller calls update().
    bool own_thread = true;
    std::size_t max_sources = 0, max_sounds = 0;
    Report report{};
    ThreadHooks thread_hooks{};
  };
  explicit World(const Options& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // The handles of new objects; 0 if there are as many as there can be.
  std::uint64_t add_level(std::shared_ptr<const BakeFile> file);
  std::uint64_t add_listener(std::shared_ptr<WorldListener> listener);

  // Null if the handle names none.
  std::shared_ptr<const BakeFile> level(std::uint64_t handle) const;
  std::shared_ptr<WorldListener> listener(std::uint64_t handle) const;

  // False if the handle names none. Removing a listener waits until the audio thread has left it.
  bool remove_level(std::uint64_t handle);
  bool remove_listener(std::uint64_t handle);

  // Without a thread of its own: makes the keyframes that are wanted now and returns how many. Then
  // loads pages and sounds for `loading_s` seconds, or until none are requested. One thread at a
  // time.
  std::size_t update(double loading_s);

  // Calls act(file) with a level, which stays open meanwhile. False if the handle names none.
  template <class Act>
  bool with_level(std::uint64_t level, const Act& act) {
    const std::lock_guard lock(tables_);
    const auto file = levels_.find(level);
    if (file != nullptr) act(*file);
    return file != nullptr;
  }

  // False if the handle names no level.
  bool change_emitter(std::uint64_t level, std::size_t emitter, const WorldEmitter& changed);
  bool set_portal(std::uint64_t level, std::size_t portal, double openness);

  WorldSources& sources() { return sources_; }
  // Prepares a sound for all listeners, so that the sampler does not have to.
  void prepare(WorldSound& sound) const;

  // The head of a SOFA file, read once; the head that Clamor brings if the path is empty.
  Result<std::shared_ptr<const Hrtf>> head(const std::string& sofa);

  // For the audio thread, without a lock.
  HandleTable<WorldListener>& rendered() noexcept { return listeners_; }

 private:
  template <class T>
  bool remove(HandleTable<T>& table, std::uint64_t handle);
  std::vector<std::shared_ptr<WorldListener>> present() const;

  void make_keyframes(const std::stop_token& stop);
  std::size_t make_keyframes(WorldListener& listener);

  const bool own_thread_;
  const Report report_;
  const std::uint64_t number_;  // among the process's worlds
  mutable std::mutex tables_;   // guards the tables, and is held for moments only
  HandleTable<const BakeFile> levels_;
  WorldSources sources_;
  HandleTable<WorldListener> listeners_;
  bool fails_ = false;  // the sampler's last keyframe
  std::mutex heads_mutex_;
  std::map<std::string, std::shared_ptr<const Hrtf>> heads_;
  std::jthread sampler_;  // stopped and joined first
};

}  // namespace clamor
