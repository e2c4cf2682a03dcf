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

// A movable part of a level, which lives as long as the level. All changes take effect with the
// next commit.
class LevelPart {
 public:
  LevelPart(clamor_context* context, clamor_part handle) : context_(context), handle_(handle) {}

  clamor_part handle() const noexcept { return handle_; }
  // Turns and moves the part about its pivot.
  void move(const clamor_pose& pose) { check(clamor_move_part(context_, handle_, &pose)); }
  // A part that is not enabled hides nothing.
  void enable(bool enabled) { check(clamor_enable_part(context_, handle_, enabled)); }
  clamor_part_info info() const {
    auto info = sized<clamor_part_info>();
    check(clamor_get_part_info(context_, handle_, &info));
    return info;
  }

 private:
  clamor_context* context_;
  clamor_part handle_;
};

// An open level; closed at the end.
class OpenLevel : public OwnedHandle<clamor_close_level> {
 public:
  using OwnedHandle::OwnedHandle;

  clamor_level_info info() const {
    auto info = sized<clamor_level_info>();
    check(clamor_get_level_info(context_, handle_, &info));
    return info;
  }
  clamor_emitter_info emitter(std::uint32_t number) const {
    auto info = sized<clamor_emitter_info>();
    check(clamor_get_emitter_info(context_, handle_, number, &info));
    return info;
  }
  // The number of the first emitter with this name, if there is one.
  std::optional<std::uint32_t> find_emitter(const std::string& name) const {
    std::uint32_t number = 0;
    const clamor_result found = clamor_find_emitter(context_, handle_, name.c_str(), &number);
    if (found == CLAMOR_ERROR_NOT_FOUND) return {};
    check(found);
    return number;
  }
  LevelPart part(std::uint32_t number) const {
    clamor_part part = 0;
    check(clamor_get_level_part(context_, handle_, number, &part));
    return {context_, part};
  }
  // The first movable part with this name, if there is one.
  std::optional<LevelPart> find_part(const std::string& name) const {
    clamor_part part = 0;
    const clamor_result found = clamor_find_part(context_, handle_, name.c_str(), &part);
    if (found == CLAMOR_ERROR_NOT_FOUND) return {};
    check(found);
    return LevelPart(context_, part);
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
    auto info = sized<clamor_portal_info>();
    check(clamor_get_portal_info(context_, handle_, number, &info));
    return info;
  }
  // The number of the first portal with this name, if there is one.
  std::optional<std::uint32_t> find_portal(const std::string& name) const {
    std::uint32_t number = 0;
    const clamor_result found = clamor_find_portal(context_, handle_, name.c_str(), &number);
    if (found == CLAMOR_ERROR_NOT_FOUND) return {};
    check(found);
    return number;
  }
  // Opens or closes a portal, with the next commit: a share of power from 0 to 1.
  void set_portal(std::uint32_t number, double openness) {
    check(clamor_set_portal(context_, handle_, number, openness));
  }
};

// A movable part that the application has added; removed at the end. All changes take effect with
// the next commit.
class Part : public OwnedHandle<clamor_remove_part> {
 public:
  using OwnedHandle::OwnedHandle;

  void move(const clamor_pose& pose) { LevelPart(context_, handle_).move(pose); }
  void enable(bool enabled) { LevelPart(context_, handle_).enable(enabled); }
  clamor_part_info info() const { return LevelPart(context_, handle_).info(); }
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
    auto statistics = sized<clamor_listener_statistics>();
    check(clamor_get_listener_statistics(context_, handle_, &statistics));
    return statistics;
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
    return made<OpenLevel>([&](std::uint64_t* level, clamor_error* error) {
      return clamor_open_level(context_, path.c_str(), level, error);
    });
  }
  OpenLevel open(const clamor_reader& reader) {
    return made<OpenLevel>([&](std::uint64_t* level, clamor_error* error) {
      return clamor_open_level_with(context_, &reader, level, error);
    });
  }
  Ears listen(const OpenLevel& level, const clamor_listener_options& options = listener_options()) {
    return made<Ears>([&](std::uint64_t* listener, clamor_error* error) {
      return clamor_create_listener(context_, level.handle(), &options, listener, error);
    });
  }
  Sound add_sound(std::span<const float> samples, std::uint32_t rate_hz, bool loops = false) {
    auto options = sized<clamor_sound_options>();
    options.rate_hz = rate_hz;
    options.loops = loops;
    return made<Sound>([&](std::uint64_t* sound, clamor_error* error) {
      return clamor_add_sound(context_, samples.data(), samples.size(), &options, sound, error);
    });
  }
  Sound read_sound(const std::string& path, bool loops = false) {
    auto options = sized<clamor_sound_options>();
    options.loops = loops;
    return made<Sound>([&](std::uint64_t* sound, clamor_error* error) {
      return clamor_read_sound(context_, path.c_str(), &options, sound, error);
    });
  }
  Sound read_sound(const OpenLevel& level, std::uint32_t number) {
    return made<Sound>([&](std::uint64_t* sound, clamor_error* error) {
      return clamor_read_level_sound(context_, level.handle(), number, sound, error);
    });
  }
  Sound add_stream(const clamor_stream& stream) {
    return made<Sound>([&](std::uint64_t* sound, clamor_error* error) {
      return clamor_add_stream(context_, &stream, sound, error);
    });
  }
  Group add_group(const clamor_group_options& options = group_options()) {
    clamor_group group = 0;
    check(clamor_add_group(context_, &options, &group));
    return {context_, group};
  }
  Source add_source(const clamor_source_options& options) {
    clamor_source source = 0;
    check(clamor_add_source(context_, &options, &source));
    return {context_, source};
  }
  Part add_part(const clamor_part_options& options) {
    return made<Part>([&](std::uint64_t* part, clamor_error* error) {
      return clamor_add_part(context_, &options, part, error);
    });
  }
  // Publishes all changes of sounds, sources, emitters, portals, groups and parts together.
  void commit(double time_s = 0) { check(clamor_commit(context_, time_s)); }

  // Returns how many keyframes were made.
  std::uint32_t update(double loading_s = 0) {
    std::uint32_t made = 0;
    check(clamor_update(context_, loading_s, &made));
    return made;
  }

 private:
  // The owner of the handle that call(&handle, &error) writes.
  template <class Owner, class Call>
  Owner made(const Call& call) {
    std::uint64_t handle = 0;
    clamor_error error;
    check(call(&handle, &error), error);
    return {context_, handle};
  }

  clamor_context* context_ = nullptr;
};

}  // namespace clamor
