#include "common/thread_team.h"

#include <exception>
#include <thread>

#include "common/platform/thread.h"

namespace clamor {

namespace {

class Team;
thread_local Team* team_of_thread = nullptr;

class Team {
 public:
  explicit Team(int threads) : size_(std::max(threads, 1)) {
    try {
      for (int i = 1; i < size_; ++i) others_.emplace_back([this] { help(); });
    } catch (...) {
      leave();
      throw;
    }
  }
  ~Team() { leave(); }
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int size() const { return size_; }

  void run(std::size_t count, std::size_t grain,
           const std::function<void(std::size_t, std::size_t)>& act) {
    Loop loop{.act = act, .count = count, .grain = grain};
    std::unique_lock lock(mutex_);
    loops_.push_back(&loop);
    work_.notify_all();
    run_parts(loop, lock);
    loops_.erase(std::find(loops_.begin(), loops_.end(), &loop));
    left_.wait(lock, [&] { return loop.threads == 0; });
    if (loop.failure) std::rethrow_exception(loop.failure);
  }

 private:
  struct Loop {
    const std::function<void(std::size_t, std::size_t)>& act;
    std::size_t count, grain, next = 0;
    int threads = 0;  // that run parts of it
    std::exception_ptr failure{};
  };

  // Takes parts until all are taken: large ones first, small ones at the end.
  void run_parts(Loop& loop, std::unique_lock<std::mutex>& lock) {
    ++loop.threads;
    while (loop.next < loop.count) {
      const std::size_t left = loop.count - loop.next, first = loop.next;
      const std::size_t part = std::max(loop.grain, left / (4 * static_cast<std::size_t>(size_)));
      const std::size_t end = loop.next = first + std::min(part, left);
      lock.unlock();
      std::exception_ptr failure;
      try {
        loop.act(first, end);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      if (!failure) continue;
      loop.next = loop.count;
      if (!loop.failure) loop.failure = failure;
    }
    if (--loop.threads == 0) left_.notify_all();
  }

  void help() {
    name_thread("team");
    team_of_thread = this;
    std::unique_lock lock(mutex_);
    while (!ends_) {
      const auto last = std::find_if(loops_.rbegin(), loops_.rend(),
                                     [](const Loop* loop) { return loop->next < loop->count; });
      if (last == loops_.rend())
        work_.wait(lock);
      else
        run_parts(**last, lock);
    }
  }

  void leave() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    work_.notify_all();
    for (std::thread& other : others_) other.join();
  }

  const int size_;
  std::mutex mutex_;
  std::condition_variable work_, left_;
  std::vector<Loop*> loops_;  // those within others come later
  bool ends_ = false;
  std::vector<std::thread> others_;
};

}  // namespace

int team_size() { return team_of_thread != nullptr ? team_of_thread->size() : usable_cores(); }

void with_team(int threads, const std::function<void()>& work) {
  if (threads <= 0) threads = usable_cores();
  if (team_of_thread != nullptr && team_of_thread->size() == threads) return work();
  Team team(threads);
  Team* const before = std::exchange(team_of_thread, &team);
  try {
    work();
  } catch (...) {
    team_of_thread = before;
    throw;
  }
  team_of_thread = before;
}

void team_for_parts(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& act) {
  if (count == 0) return;
  if (count <= grain || team_size() == 1) return act(0, count);
  if (team_of_thread != nullptr) return team_of_thread->run(count, grain, act);
  with_team(0, [&] { team_of_thread->run(count, grain, act); });
}

}  // namespace clamor
