// clamor.hpp: clamor.h for C++20: owners instead of handles, spans instead of pointers, exceptions
// instead of codes.
//
// Functions throw clamor::Failure where those of clamor.h return an error, except Ears::render()
// and Sound::write(), which are for the audio thread and return the code. Objects must not outlive
// their Clamor.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
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

// A structure of clamor.h with its size filled in and all else 0, which means the default.
template <class T>
T sized() {
  T structure{};
  structure.bytes = sizeof(structure);
  return structure;
}
inline clamor_options context_options() { return sized<clamor_options>(); }
inline clamor_listener_options listener_options() { return sized<clamor_listener_options>(); }
inline clamor_source_options source_options() { return sized<clamor_source_options>(); }
inline clamor_group_options group_options() { return sized<clamor_group_options>(); }
inline clamor_part_options part_options() { return sized<clamor_part_options>(); }

// Returns what a function of clamor.h writes to its last argument before the error. The size of a
// structure is filled in.
template <class T, class Function, class... Arguments>
T written(Function* function, Arguments... arguments) {
  T value{};
  if constexpr (requires { value.bytes; }) value.bytes = sizeof(value);
  if constexpr (std::is_invocable_v<Function*, Arguments..., T*, clamor_error*>) {
    clamor_error error;
    check(function(arguments..., &value, &error), error);
  } else {
    check(function(arguments..., &value));
  }
  return value;
}

// The handle of something in a context.
class Handle {
 public:
  Handle(clamor_context* context, std::uint64_t handle) : context_(context), handle_(handle) {}

  std::uint64_t handle() const noexcept { return handle_; }

 protected:
  clamor_context* context_;
  std::uint64_t handle_;
};

// A handle that is given back at the end, once.
template <clamor_result (*Release)(clamor_context*, std::uint64_t)>
class OwnedHandle : public Handle {
 public:
  using Handle::Handle;
  OwnedHandle(OwnedHandle&& other) noexcept
      : Handle(other.context_, std::exchange(other.handle_, 0)) {}
  OwnedHandle& operator=(OwnedHandle&& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~OwnedHandle() {
    if (handle_ != 0) Release(context_, handle_);
  }
};

// A movable part. All changes take effect with the next commit.
template <class Base>
class MovablePart : public Base {
 public:
  using Base::Base;

  // Turns and moves the part about its pivot.
  void move(const clamor_pose& pose) {
    check(clamor_move_part(this->context_, this->handle_, &pose));
  }
  // A part that is not enabled hides nothing.
  void enable(bool enabled) { check(clamor_enable_part(this->context_, this->handle_, enabled)); }
  clamor_part_info info() const {
    return written<clamor_part_info>(clamor_get_part_info, this->context_, this->handle_);
  }
};
using LevelPart = MovablePart<Handle>;  // lives as long as the level
using Part =
    MovablePart<OwnedHandle<clamor_remove_part>>;  // of the application; removed at the end

// An open level; closed at the end.
class OpenLevel : public OwnedHandle<clamor_close_level> {
 public:
  using OwnedHandle::OwnedHandle;

  clamor_level_info info() const {
    return written<clamor_level_info>(clamor_get_level_info, context_, handle_);
  }
  clamor_emitter_info emitter(std::uint32_t number) const {
    return written<clamor_emitter_info>(clamor_get_emitter_info, context_, handle_, number);
  }
  // The number of the first emitter with this name, if there is one.
  std::optional<std::uint32_t> find_emitter(const std::string& name) const {
    return found<std::uint32_t>(clamor_find_emitter, name);
  }
  LevelPart part(std::uint32_t number) const {
    return {context_, written<clamor_part>(clamor_get_level_part, context_, handle_, number)};
  }
  // The first movable part with this name, if there is one.
  std::optional<LevelPart> find_part(const std::string& name) const {
    const auto part = found<clamor_part>(clamor_find_part, name);
    return part ? std::optional(LevelPart(context_, *part)) : std::nullopt;
  }
  // Turns an emitter down, with the next commit: an amplitude from 0 to 1, times that of the group.
  void change_emitter(std::uint32_t number, double gain, clamor_group group = 0) {
    auto options = sized<clamor_emitter_options>();
    options.has_gain = 1;
    options.gain = gain;
    options.group = group;
    check(clamor_change_emitter(context_, handle_, number, &options));
  }
  clamor_portal_info portal(std::uint32_t number) const {
    return written<clamor_portal_info>(clamor_get_portal_info, context_, handle_, number);
  }
  // The number of the first portal with this name, if there is one.
  std::optional<std::uint32_t> find_portal(const std::string& name) const {
    return found<std::uint32_t>(clamor_find_portal, name);
  }
  // Opens or closes a portal, with the next commit: a share of power from 0 to 1.
  void set_portal(std::uint32_t number, double openness) {
    check(clamor_set_portal(context_, handle_, number, openness));
  }

 private:
  template <class T, class Function>
  std::optional<T> found(Function* function, const std::string& name) const {
    T value{};
    const clamor_result result = function(context_, handle_, name.c_str(), &value);
    if (result == CLAMOR_ERROR_NOT_FOUND) return {};
    check(result);
    return value;
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
    return written<std::uint32_t>(clamor_get_channels, context_, handle_);
  }
  // The time for which an offline listener's next pose is wanted, if one is.
  std::optional<double> next_keyframe_s() const {
    std::uint32_t wanted = 0;
    double time_s = 0;
    check(clamor_next_keyframe(context_, handle_, &wanted, &time_s));
    return wanted != 0 ? std::optional(time_s) : std::nullopt;
  }
  clamor_listener_statistics statistics() const {
    return written<clamor_listener_statistics>(clamor_get_listener_statistics, context_, handle_);
  }

  // Reads voices of the newest keyframe into the span. The result tells how many there are, which
  // may be more, and the keyframe's time.
  clamor_voices voices(std::span<clamor_voice> into) const {
    auto voices = sized<clamor_voices>();
    voices.voices = into.data();
    voices.capacity = static_cast<std::uint32_t>(into.size());
    check(clamor_get_voices(context_, handle_, &voices));
    return voices;
  }

  // Audio thread: fills `frames` frames; the span has room for all channels of them.
  clamor_result render(std::span<float> interleaved, std::uint32_t frames) noexcept {
    return clamor_render(context_, handle_, interleaved.data(), frames);
  }
};

// A sound or a stream; removed at the end, with the sources that play it.
class Sound : public OwnedHandle<clamor_remove_sound> {
 public:
  using OwnedHandle::OwnedHandle;

  // Audio thread: appends to a stream, and writes to `taken` how many samples fitted.
  clamor_result write(std::span<const float> samples, std::uint32_t& taken) noexcept {
    return clamor_write_stream(context_, handle_, samples.data(),
                               static_cast<std::uint32_t>(samples.size()), &taken);
  }
};

// A group of sources; removed at the end.
class Group : public OwnedHandle<clamor_remove_group> {
 public:
  using OwnedHandle::OwnedHandle;

  void change(const clamor_group_options& options) {
    check(clamor_change_group(context_, handle_, &options));
  }
};

// A source; removed at the end. All changes take effect with the next commit.
class Source : public OwnedHandle<clamor_remove_source> {
 public:
  using OwnedHandle::OwnedHandle;

  void move(const clamor_motion& motion) { check(clamor_move_source(context_, handle_, &motion)); }
  void change(const clamor_source_options& options) {
    check(clamor_change_source(context_, handle_, &options));
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
    return made<OpenLevel>(clamor_open_level, path.c_str());
  }
  OpenLevel open(const clamor_reader& reader) {
    return made<OpenLevel>(clamor_open_level_with, &reader);
  }
  Ears listen(const OpenLevel& level, const clamor_listener_options& options = listener_options()) {
    return made<Ears>(clamor_create_listener, level.handle(), &options);
  }
  Sound add_sound(std::span<const float> samples, std::uint32_t rate_hz, bool loops = false) {
    auto options = sized<clamor_sound_options>();
    options.rate_hz = rate_hz;
    options.loops = loops;
    return made<Sound>(clamor_add_sound, samples.data(), samples.size(), &options);
  }
  Sound read_sound(const std::string& path, bool loops = false) {
    auto options = sized<clamor_sound_options>();
    options.loops = loops;
    return made<Sound>(clamor_read_sound, path.c_str(), &options);
  }
  Sound read_sound(const OpenLevel& level, std::uint32_t number) {
    return made<Sound>(clamor_read_level_sound, level.handle(), number);
  }
  Sound add_stream(const clamor_stream& stream) { return made<Sound>(clamor_add_stream, &stream); }
  Group add_group(const clamor_group_options& options = group_options()) {
    return made<Group>(clamor_add_group, &options);
  }
  Source add_source(const clamor_source_options& options) {
    return made<Source>(clamor_add_source, &options);
  }
  Part add_part(const clamor_part_options& options) {
    return made<Part>(clamor_add_part, &options);
  }
  // Publishes all changes of sounds, sources, emitters, portals, groups and parts together.
  void commit(double time_s = 0) { check(clamor_commit(context_, time_s)); }

  // Returns how many keyframes were made.
  std::uint32_t update(double loading_s = 0) {
    return written<std::uint32_t>(clamor_update, context_, loading_s);
  }

 private:
  // The owner of what a function makes.
  template <class Owner, class Function, class... Arguments>
  Owner made(Function* function, Arguments... arguments) {
    return {context_, written<std::uint64_t>(function, context_, arguments...)};
  }

  clamor_context* context_ = nullptr;
};

}  // namespace clamor
