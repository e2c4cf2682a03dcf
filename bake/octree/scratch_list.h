// scratch_list.h: a list in memory, or in a temporary file that is mapped into memory.
//
// The same code works on both. In a file, the elements that have been visited leave the memory
// (release()), and the system moves them to the disk and back; code that visits elements block by
// block, in order, therefore needs the memory of a few blocks.
//
// Threads: one at a time; elements as those of a vector.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "bake/octree/scratch_file.h"

namespace clamor {

template <class T>
class ScratchList {
  static_assert(std::is_trivially_copyable_v<T>, "its bytes are those of a file");

 public:
  static constexpr std::size_t kBlock = 16384;  // elements

  // In a file beside `beside`; in memory if that is empty.
  explicit ScratchList(std::string beside = {}) : file_(std::move(beside)) {}
  explicit ScratchList(std::vector<T> elements) : memory_(std::move(elements)) {}

  bool is_in_file() const { return !beside().empty(); }
  const std::string& beside() const { return file_.beside(); }
  std::size_t size() const { return is_in_file() ? count_ : memory_.size(); }
  std::span<T> all() { return is_in_file() ? mapped_.first(count_) : std::span(memory_); }
  std::span<const T> all() const {
    return is_in_file() ? std::span<const T>(mapped_.first(count_)) : std::span(memory_);
  }

  // Makes room for `capacity` elements. Only this and what exceeds the room can fail.
  Result<void> reserve(std::size_t capacity) {
    if (!is_in_file()) memory_.reserve(capacity);
    if (!is_in_file() || capacity <= mapped_.size()) return {};
    const auto mapped = file_.map(capacity * sizeof(T));
    if (!mapped.ok()) return mapped.error();
    mapped_ = {reinterpret_cast<T*>(mapped->data()), capacity};
    return {};
  }

  // Elements that are added to a list in a file are zero.
  Result<void> resize(std::size_t count) {
    if (!is_in_file()) memory_.resize(count);
    count_ = count;
    return is_in_file() ? reserve(count) : Result<void>();
  }

  Result<void> append(std::span<const T> elements) {
    if (!is_in_file()) {
      memory_.insert(memory_.end(), elements.begin(), elements.end());
      return {};
    }
    if (count_ + elements.size() > mapped_.size())
      if (auto grown = reserve(count_ + std::max(elements.size(), count_ / 4)); !grown.ok())
        return grown;
    std::copy(elements.begin(), elements.end(),
              mapped_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ += elements.size();
    if (count_ / kBlock > (count_ - elements.size()) / kBlock) {
      const std::size_t first = (count_ - elements.size()) / kBlock * kBlock;
      release(first, count_ - first);
    }
    return {};
  }

  // Lets the elements leave the memory until they are used again.
  void release(std::size_t first, std::size_t count) {
    if (is_in_file()) SystemFile::release(std::as_writable_bytes(mapped_.subspan(first, count)));
  }
  void release() { release(0, size()); }

  // Calls visit(elements, index of the first) for all in order, block by block.
  template <class Visit>
  void for_blocks(const Visit& visit) {
    for (std::size_t first = 0; first < size(); first += kBlock) {
      const std::size_t count = std::min(kBlock, size() - first);
      visit(all().subspan(first, count), first);
      release(first, count);
    }
  }

  // The list's vector, which it must have: it is in memory.
  std::vector<T> take_vector() && { return std::move(memory_); }

 private:
  std::vector<T> memory_;
  ScratchFile file_;
  std::span<T> mapped_;
  std::size_t count_ = 0;  // of `mapped_`
};

}  // namespace clamor
