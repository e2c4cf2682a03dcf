// clamor.hpp: clamor.h for C++20: owners instead of handles, spans instead of pointers, exceptions
// instead of codes.
//
// Functions throw clamor::Failure where those of clamor.h return an error, except Ears::render(),
// which is for the audio thread and returns the code. Objects must not outlive their Clamor.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include <clamor.h>

namespace clamor {

class Failure : public std::runtime_error {
 public:
  Failure(clamor_result code, const char* sentence) : std::runtime_error(sentence), code_(code) {}
  clamor_result code() const noexcept { return code_; }

 private:
  clamor_result code_;
};

inline void check(clamor_result result) {
  if (result != CLAMOR_OK) throw Failure(result, clamor_result_text(result));
}
inline void check(clamor_result result, const clamor_error& error) {
  if (result != CLAMOR_OK) throw Failure(result, error.sentence);
}

// The options of clamor.h with their size filled in.
inline clamor_options context_options() {
  clamor_options options{};
  options.bytes = sizeof(options);
  return options;
}
inline clamor_listener_options listener_options() {
  clamor_listener_options options{};
  options.bytes = sizeof(options);
  return options;
}

// A handle that is given back at the end, once.
template <clamor_result (*Release)(clamor_context*, std::uint64_t)>
class OwnedHandle {
 public:
  OwnedHandle(clamor_context* context, std::uint64_t handle) : context_(context), handle_(handle) {}
  OwnedHandle(OwnedHandle&& other) noexcept
      : context_(other.context_), handle_(std::exchange(other.handle_, 0)) {}
  OwnedHandle& operator=(OwnedHandle&& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~OwnedHandle() {
    if (handle_ != 0) Release(context_, handle_);
  }

  std::uint64_t handle() const noexcept { return handle_; }

 protected:
  clamor_context* context_;
  std::uint64_t handle_;
};

// An open level; closed at the end.
class OpenLevel : public OwnedHandle<clamor_close_level> {
 public:
  using OwnedHandle::OwnedHandle;

  clamor_level_info info() const {
    clamor_level_info info{};
    info.bytes = sizeof(info);
    check(clamor_get_level_info(context_, handle_, &info));
    return info;
  }
};

// A listener; removed at the end.
class Ears : public OwnedHandle<clamor_destroy_listener> {
 public:
  using OwnedHandle::OwnedHandle;

  void move(const clamor_pose& pose) { check(clamor_move_listener(context_, handle_, &pose)); }
  void enter(const OpenLevel& level) {
    clamor_error error;
    check(clamor_enter_level(context_, handle_, level.handle(), &error), error);
  }
  std::uint32_t channels() const {
    std::uint32_t channels = 0;
    check(clamor_get_channels(context_, handle_, &channels));
    return channels;
  }
  // The time for which an offline listener's next pose is wanted, if one is.
  std::optional<double> next_keyframe_s() const {
    std::uint32_t wanted = 0;
    double time_s = 0;
    check(clamor_next_keyframe(context_, handle_, &wanted, &time_s));
    return wanted != 0 ? std::optional(time_s) : std::nullopt;
  }
  clamor_listener_statistics statistics() const {
    clamor_listener_statistics statistics{};
    statistics.bytes = sizeof(statistics);
    check(clamor_get_listener_statistics(context_, handle_, &statistics));
    return statistics;
  }

  // Audio thread: fills `frames` frames; the span has room for all channels of them.
  clamor_result render(std::span<float> interleaved, std::uint32_t frames) noexcept {
    return clamor_render(context_, handle_, interleaved.data(), frames);
  }
};

// A context; destroyed at the end.
class Clamor {
 public:
  explicit Clamor(const clamor_options& options = context_options()) {
    clamor_error error;
    check(clamor_create(&options, &context_, &error), error);
  }
  Clamor(Clamor&& other) noexcept : context_(std::exchange(other.context_, nullptr)) {}
  Clamor& operator=(Clamor&& other) noexcept {
    std::swap(context_, other.context_);
    return *this;
  }
  ~Clamor() { clamor_destroy(context_); }

  clamor_context* get() const noexcept { return context_; }

  OpenLevel open(const std::string& path) {
    clamor_level level = 0;
    clamor_error error;
    check(clamor_open_level(context_, path.c_str(), &level, &error), error);
    return {context_, level};
  }
  OpenLevel open(const clamor_reader& reader) {
    clamor_level level = 0;
    clamor_error error;
    check(clamor_open_level_with(context_, &reader, &level, &error), error);
    return {context_, level};
  }
  Ears listen(const OpenLevel& level, const clamor_listener_options& options = listener_options()) {
    clamor_listener listener = 0;
    clamor_error error;
    check(clamor_create_listener(context_, level.handle(), &options, &listener, &error), error);
    return {context_, listener};
  }
  // Returns how many keyframes were made.
  std::uint32_t update(double loading_s = 0) {
    std::uint32_t made = 0;
    check(clamor_update(context_, loading_s, &made));
    return made;
  }

 private:
  clamor_context* context_ = nullptr;
};

}  // namespace clamor
