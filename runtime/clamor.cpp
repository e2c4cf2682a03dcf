#include "runtime/clamor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "common/c_structures.h"
#include "common/listener.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/files/random_access_file.h"
#include "formats/level/emitter.h"
#include "runtime/clamor_context.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/block_mixer.h"
#include "runtime/realtime/prefault_stack.h"
#include "runtime/world/world.h"

namespace {

using clamor::copy_from_caller;
using clamor::copy_to_caller;
using clamor::Error;
using clamor::Listener;
using clamor::Orientation;
using clamor::OutputFormat;
using clamor::Quaternion;
using clamor::Result;
using clamor::size_refusal;
using clamor::Vec3;
using clamor::WorldListener;
using clamor::interface::entered;
using clamor::interface::fail;
using clamor::interface::guarded;
using clamor::interface::hand_out;
using clamor::interface::is_missing;
using clamor::interface::kMaxPosition_m;
using clamor::interface::Loan;
using clamor::interface::refuse;

constexpr std::uint32_t kMinRate_hz = 8000, kMaxRate_hz = 192'000;
constexpr std::uint32_t kMaxVoices = 100'000;
constexpr std::uint32_t kDefaultBlock_frames = 1024;
constexpr double kMaxOutputGain = 1e10;  // 200 dB
constexpr double kMaxUpdatePeriod_s = 0.1;
constexpr std::uint32_t kDefaultSources = 1024, kDefaultSounds = 256;

bool read_pose(const clamor_pose& pose, Listener& listener) {
  Vec3 position_m;
  Quaternion rotation;
  if (!clamor::interface::read_pose(pose, kMaxPosition_m, position_m, rotation)) return false;
  listener = Listener(position_m, Orientation(rotation));
  return true;
}

Result<OutputFormat> read_output(clamor_context& context, const clamor_listener_options& options) {
  const bool speakers = options.output == CLAMOR_OUTPUT_LOUDSPEAKERS;
  auto output = OutputFormat::from_options(options.output == CLAMOR_OUTPUT_BINAURAL,
                                           !speakers                   ? ""
                                           : options.layout != nullptr ? options.layout
                                                                       : "stereo",
                                           options.output == CLAMOR_OUTPUT_AMBISONICS);
  if (!output.ok() || options.output != CLAMOR_OUTPUT_BINAURAL) return output;
  auto head = context.world.head(options.sofa != nullptr ? options.sofa : "");
  if (!head.ok()) return head.error();
  output->head = std::move(*head);
  return output;
}

// Fills in the defaults; false if a member is out of range.
bool complete(clamor_listener_options& options) {
  if (options.rate_hz == 0) options.rate_hz = clamor::kSampleRate_hz;
  if (options.max_block_frames == 0) options.max_block_frames = kDefaultBlock_frames;
  const clamor::AuralizerOptions defaults;
  if (options.voices == 0) options.voices = static_cast<std::uint32_t>(defaults.voices);
  if (options.gain == 0) options.gain = 1;
  double* const orientation = options.pose.orientation;
  if (std::all_of(orientation, orientation + 4, [](double part) { return part == 0; }))
    orientation[3] = 1;
  return options.output <= CLAMOR_OUTPUT_NONE && options.rate_hz >= kMinRate_hz &&
         options.rate_hz <= kMaxRate_hz &&
         options.max_block_frames <= static_cast<std::uint32_t>(clamor::kLargestBlock_frames) &&
         options.voices <= kMaxVoices && options.mixing <= CLAMOR_MIXING_VOICES &&
         options.late <= CLAMOR_LATE_DENSE && options.gain > 0 && options.gain <= kMaxOutputGain;
}

// The auralizer's options. The largest block is one of the mixer's frames, of which a slower output
// takes more.
clamor::AuralizerOptions auralizer_options(clamor_context& context,
                                           const clamor_listener_options& options,
                                           OutputFormat output) {
  clamor::AuralizerOptions made;
  made.output = std::move(output);
  made.voices = static_cast<int>(options.voices);
  constexpr std::array kMixings{clamor::Mixing::kAuto, clamor::Mixing::kField,
                                clamor::Mixing::kVoices};
  made.has_dense_late = options.late == CLAMOR_LATE_DENSE;
  made.mixing =
      options.reports_voices != 0 && options.mixing == CLAMOR_MIXING_AUTO && !made.has_dense_late
          ? clamor::Mixing::kVoices
          : kMixings[static_cast<std::size_t>(options.mixing)];
  made.memory_bytes = options.memory_bytes;
  made.gain = options.gain;
  made.limit = options.limits != 0;
  const double mixed_frames =
      std::ceil(1.0 * options.max_block_frames * clamor::kSampleRate_hz / options.rate_hz);
  made.block_frames = static_cast<int>(std::min(mixed_frames, 1.0 * clamor::kLargestBlock_frames));
  made.wait_for_pages = options.offline != 0;
  made.tracks_head = options.offline == 0;
  made.own_threads = !context.caller_updates;
  if (context.caller_updates) made.first_sounds_s = 0;  // the loudest; updates load the others
  made.thread_hooks = context.thread_hooks;
  made.report = context.report;
  made.sampler_period_s = context.update_period_s;
  made.moving.max_sources = context.world.sources().max_sources();
  made.moving.signal_slots = context.world.sources().max_sounds();
  made.takes_parts = true;
  made.keeps_keyframe = options.reports_voices != 0;
  made.mixes_voices = options.output != CLAMOR_OUTPUT_NONE;
  return made;
}

clamor_result add_level(clamor_context& context, Result<clamor::BakeFile> file, clamor_level* level,
                        clamor_error* error) {
  if (!file.ok()) return fail(error, CLAMOR_ERROR_FILE, file.error().message);
  return hand_out(
      context.world.add_level(std::make_shared<const clamor::BakeFile>(std::move(*file))), level,
      error);
}

// Enters the listener for one block on the audio thread.
template <class Render>
clamor_result rendered(clamor_context* context, clamor_listener handle,
                       const Render& render) noexcept {
  if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
  clamor::prefault_stack();
  return entered(context->world.rendered(), handle, render);
}

}  // namespace

extern "C" {

const char* clamor_result_text(clamor_result result) {
  switch (result) {
    case CLAMOR_OK:
      return "no error";
    case CLAMOR_ERROR_ARGUMENT:
      return "an argument is null, not finite or out of range, or a structure's bytes is not its "
             "size";
    case CLAMOR_ERROR_HANDLE:
      return "the handle names no object of this context";
    case CLAMOR_ERROR_FILE:
      return "a file cannot be read or is damaged";
    case CLAMOR_ERROR_MEMORY:
      return "there is not enough memory";
    case CLAMOR_ERROR_FULL:
      return "the context holds as many such objects as it can";
    case CLAMOR_ERROR_BUSY:
      return "another thread is rendering this listener";
    case CLAMOR_ERROR_STATE:
      return "the call is not possible now, or not with these options";
    case CLAMOR_ERROR_NOT_FOUND:
      return "nothing has this name";
    case CLAMOR_ERROR_INTERNAL:
      return "a fault of the library";
    default:
      return "an unknown code";
  }
}

uint32_t clamor_version(void) {
  return CLAMOR_VERSION_MAJOR << 16 | CLAMOR_VERSION_MINOR << 8 | CLAMOR_VERSION_PATCH;
}

uint32_t clamor_abi_version(void) { return CLAMOR_ABI_VERSION; }

clamor_result clamor_create(const clamor_options* options, clamor_context** context,
                            clamor_error* error) {
  return guarded(error, [&] {
    if (context == nullptr) return fail(error, CLAMOR_ERROR_ARGUMENT);
    *context = nullptr;
    clamor::interface::watch_forks();
    if (clamor::interface::fork_count() > 0)
      return fail(error, CLAMOR_ERROR_STATE,
                  "this process was forked from one that had used Clamor, and has none of its "
                  "threads; make contexts after fork() alone, or exec() in the child");
    clamor_options chosen;
    if (!copy_from_caller(options, chosen))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(options));
    if (chosen.update_period_s == 0) chosen.update_period_s = 1.0 / 30;
    if (!(chosen.update_period_s > 0 && chosen.update_period_s <= kMaxUpdatePeriod_s))
      return fail(error, CLAMOR_ERROR_ARGUMENT, "update_period_s must lie between 0 and 0.1 s");
    if (chosen.max_sources == 0) chosen.max_sources = kDefaultSources;
    if (chosen.max_sounds == 0) chosen.max_sounds = kDefaultSounds;
    if (chosen.max_sources > clamor::kMaxWorldSources ||
        chosen.max_sounds > clamor::kMaxWorldSounds)
      return fail(error, CLAMOR_ERROR_ARGUMENT,
                  "there may be at most 65 536 sources and 4096 sounds");
    *context = new clamor_context(chosen);
    return clamor_result{CLAMOR_OK};
  });
}

void clamor_destroy(clamor_context* context) {
  if (!is_missing(context)) delete context;
}

clamor_result clamor_update(clamor_context* context, double loading_s, uint32_t* made) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || !(loading_s >= 0)) return CLAMOR_ERROR_ARGUMENT;
    if (!context->caller_updates) return CLAMOR_ERROR_STATE;
    const std::size_t count = context->world.update(std::min(loading_s, 3600.0));
    if (made != nullptr) *made = static_cast<uint32_t>(count);
    return CLAMOR_OK;
  });
}

clamor_result clamor_open_level(clamor_context* context, const char* path, clamor_level* level,
                                clamor_error* error) {
  return guarded(error, [&] {
    if (is_missing(context) || path == nullptr || level == nullptr)
      return fail(error, CLAMOR_ERROR_ARGUMENT);
    return add_level(*context, clamor::BakeFile::open(path), level, error);
  });
}

clamor_result clamor_open_level_with(clamor_context* context, const clamor_reader* reader,
                                     clamor_level* level, clamor_error* error) {
  return guarded(error, [&] {
    clamor_reader chosen;
    if (is_missing(context) || level == nullptr || reader == nullptr ||
        !copy_from_caller(reader, chosen) ||
        (chosen.read == nullptr && (chosen.memory == nullptr || chosen.size > SIZE_MAX)))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(reader));
    Loan loan(chosen.user, chosen.release);
    clamor::SuppliedBytes bytes;
    bytes.size = chosen.size;
    bytes.owner = loan.owner();
    if (chosen.memory != nullptr)
      bytes.memory = {static_cast<const std::byte*>(chosen.memory),
                      static_cast<std::size_t>(chosen.size)};
    else
      bytes.read = [read = chosen.read, user = chosen.user](
                       std::uint64_t offset, std::span<std::byte> into) -> Result<void> {
        if (read(user, offset, into.size(), into.data()) == 0) return {};
        return Error("cannot be read by the application");
      };
    const std::string name = chosen.name != nullptr ? chosen.name : "the level";
    return loan.keep_after(
        add_level(*context, clamor::BakeFile::open(std::move(bytes), name), level, error));
  });
}

clamor_result clamor_close_level(clamor_context* context, clamor_level level) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.remove_level(level) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_get_level_info(clamor_context* context, clamor_level level,
                                    clamor_level_info* info) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    const auto file = context->world.level(level);
    if (file == nullptr) return CLAMOR_ERROR_HANDLE;
    clamor_level_info filled{};
    filled.portals = static_cast<uint32_t>(file->portals().portals.size());
    filled.emitters = static_cast<uint32_t>(file->emitters().size());
    filled.sounds = static_cast<uint32_t>(file->signal_count());
    filled.sources = file->source_count();
    filled.parts = static_cast<uint32_t>(file->movable_parts().size());
    return copy_to_caller(filled, info) ? CLAMOR_OK : refuse(context, info);
  });
}

clamor_result clamor_create_listener(clamor_context* context, clamor_level level,
                                     const clamor_listener_options* options,
                                     clamor_listener* listener, clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    clamor_listener_options chosen;
    WorldListener::Options made;
    if (is_missing(context) || listener == nullptr || !copy_from_caller(options, chosen) ||
        !complete(chosen) || !read_pose(chosen.pose, made.listener))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(options));
    if (chosen.late == CLAMOR_LATE_DENSE && chosen.mixing == CLAMOR_MIXING_VOICES)
      return fail(error, CLAMOR_ERROR_ARGUMENT,
                  "dense late sound is made by a field, so it does not go with "
                  "CLAMOR_MIXING_VOICES");
    if (chosen.offline != 0 && !context->caller_updates)
      return fail(error, CLAMOR_ERROR_STATE,
                  "an offline listener needs a context with caller_updates");
    const auto file = context->world.level(level);
    if (file == nullptr) return fail(error, CLAMOR_ERROR_HANDLE);
    auto output = read_output(*context, chosen);
    if (!output.ok()) return fail(error, CLAMOR_ERROR_FILE, output.error().message);
    made.auralizer = auralizer_options(*context, chosen, std::move(*output));
    made.rate_hz = static_cast<int>(chosen.rate_hz);
    made.sources = &context->world.sources();
    auto created = WorldListener::create({file, level}, made);
    if (!created.ok()) return fail(error, CLAMOR_ERROR_FILE, created.error().message);
    return hand_out(context->world.add_listener(std::move(*created)), listener, error);
  });
}

clamor_result clamor_destroy_listener(clamor_context* context, clamor_listener listener) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.remove_listener(listener) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_enter_level(clamor_context* context, clamor_listener listener,
                                 clamor_level level, clamor_error* error) {
  return guarded(error, [&] {
    if (is_missing(context)) return fail(error, CLAMOR_ERROR_ARGUMENT);
    const auto mover = context->world.listener(listener);
    const auto file = context->world.level(level);
    if (mover == nullptr || file == nullptr) return fail(error, CLAMOR_ERROR_HANDLE);
    const auto entered = mover->enter({file, level});
    if (!entered.ok()) return fail(error, CLAMOR_ERROR_FILE, entered.error().message);
    return clamor_result{CLAMOR_OK};
  });
}

clamor_result clamor_move_listener(clamor_context* context, clamor_listener listener,
                                   const clamor_pose* pose) {
  return guarded(nullptr, [&]() -> clamor_result {
    Listener moved;
    if (is_missing(context) || pose == nullptr || !read_pose(*pose, moved))
      return CLAMOR_ERROR_ARGUMENT;
    const auto mover = context->world.listener(listener);
    if (mover == nullptr) return CLAMOR_ERROR_HANDLE;
    mover->move(moved);
    return CLAMOR_OK;
  });
}

clamor_result clamor_next_keyframe(clamor_context* context, clamor_listener listener,
                                   uint32_t* wanted, double* time_s) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || wanted == nullptr || time_s == nullptr) return CLAMOR_ERROR_ARGUMENT;
    const auto asked = context->world.listener(listener);
    if (asked == nullptr) return CLAMOR_ERROR_HANDLE;
    const auto next_s = asked->wanted_keyframe_s();
    *wanted = next_s.has_value();
    *time_s = next_s.value_or(0);
    return CLAMOR_OK;
  });
}

clamor_result clamor_get_channels(clamor_context* context, clamor_listener listener,
                                  uint32_t* channels) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || channels == nullptr) return CLAMOR_ERROR_ARGUMENT;
    const auto asked = context->world.listener(listener);
    if (asked == nullptr) return CLAMOR_ERROR_HANDLE;
    *channels = static_cast<uint32_t>(asked->channels());
    return CLAMOR_OK;
  });
}

clamor_result clamor_get_listener_statistics(clamor_context* context, clamor_listener listener,
                                             clamor_listener_statistics* statistics) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    const auto asked = context->world.listener(listener);
    if (asked == nullptr) return CLAMOR_ERROR_HANDLE;
    const clamor::AuralizerStatistics counted = asked->statistics();
    clamor_listener_statistics filled{};
    filled.voices = counted.voices;
    filled.keyframes = counted.keyframes;
    filled.held_blocks = counted.held_blocks;
    filled.keyframe_ms = counted.sampler_ms;
    filled.pages = counted.pages.resident;
    filled.page_bytes = counted.pages.bytes;
    filled.sound_bytes = counted.sounds.bytes;
    filled.failures = counted.pages.failed + counted.sounds.failed;
    filled.unseen_sources = counted.unseen_sources;
    return copy_to_caller(filled, statistics) ? CLAMOR_OK : refuse(context, statistics);
  });
}

clamor_result clamor_render(clamor_context* context, clamor_listener listener, float* interleaved,
                            uint32_t frames) {
  if (interleaved == nullptr) return CLAMOR_ERROR_ARGUMENT;
  return rendered(context, listener, [=](WorldListener& heard) noexcept -> clamor_result {
    heard.render(std::span(interleaved, frames * heard.channels()));
    return CLAMOR_OK;
  });
}

clamor_result clamor_render_planar(clamor_context* context, clamor_listener listener,
                                   float* const* planes, uint32_t frames) {
  if (planes == nullptr) return CLAMOR_ERROR_ARGUMENT;
  return rendered(context, listener, [=](WorldListener& heard) noexcept -> clamor_result {
    for (std::size_t c = 0; c < heard.channels(); ++c)
      if (planes[c] == nullptr) return CLAMOR_ERROR_ARGUMENT;
    heard.render(planes, frames);
    return CLAMOR_OK;
  });
}

}  // extern "C"
