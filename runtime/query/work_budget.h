// work_budget.h: bounds the cost of a keyframe's queries, by counting work and never by time.
//
// A unit is about 10 ns of one core. Queries spend units as they proceed and give up once the
// budget is exhausted. Because work is counted, the same walk gives the same samples on any
// machine, however busy. A stop flag exhausts every budget, so that ending a program never waits
// for a long query.
//
// Threads: the sampler's alone; the stop flag may be set by any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

namespace clamor {

// Whether a search ends where its budget does, or finds all.
enum class SearchBound { kBounded, kUnbounded };

class WorkBudget {
 public:
  static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

  // Costs in units, measured on octrees of 10^5 to 10^7 sources.
  static constexpr std::uint64_t kNode = 50;         // visiting a page of the octree
  static constexpr std::uint64_t kFrontNode = 4;     // testing a node of a front again
  static constexpr std::uint64_t kFrontStep = 20;    // adding a node to a front
  static constexpr std::uint64_t kInstance = 2;      // testing an instance that is not traversed
  static constexpr std::uint64_t kFound = 12;        // finding and weighing a source
  static constexpr std::uint64_t kCulledSource = 2;  // testing a source for a shortlist
  static constexpr std::uint64_t kListedSource = 3;  // adding a source to a shortlist
  static constexpr std::uint64_t kMovingPer16 = 1;   // testing 16 moving sources
  static constexpr std::uint64_t kFirstReflectionsPer16 = 6;  // testing 16 first reflections

  void limit(std::uint64_t units) { limit_ = units == kUnlimited ? units : spent_ + units; }
  void stop_when(const std::atomic<bool>* stop) { stop_ = stop; }

  void spend(std::uint64_t units) { spent_ += units; }
  std::uint64_t spent() const { return spent_; }
  bool is_stopped() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }
  bool is_exhausted() const { return spent_ > limit_ || is_stopped(); }

 private:
  std::uint64_t spent_ = 0, limit_ = kUnlimited;
  const std::atomic<bool>* stop_ = nullptr;
};

}  // namespace clamor
