// clamor_sources.cpp: the sounds, sources and groups of the C interface.
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "common/c_structures.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/level_origin.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/world/live_feed.h"
#include "runtime/world/world_sound.h"
#include "runtime/world/world_sources.h"

namespace {

using clamor::copy_from_caller;
using clamor::LiveFeed;
using clamor::Result;
using clamor::Signal;
using clamor::size_refusal;
using clamor::SourceMotion;
using clamor::Vec3;
using clamor::WorldGroup;
using clamor::WorldSound;
using clamor::WorldSource;
using clamor::WorldSources;
using clamor::interface::entered;
using clamor::interface::fail;
using clamor::interface::guarded;
using clamor::interface::hand_out;
using clamor::interface::is_missing;
using clamor::interface::Loan;
using clamor::interface::refuse;

constexpr std::uint32_t kMinStreamRate_hz = 8000, kMaxStreamRate_hz = 192'000;
constexpr double kMaxSpeed_mps = 1e4, kMaxPlayed_s = 1e6, kMaxExponent = 1e4;

bool read_vector(const double (&given)[3], double limit, Vec3& vector) {
  for (const double part : given)
    if (!(std::abs(part) <= limit)) return false;
  vector = {given[0], given[1], given[2]};
  return true;
}

bool read_motion(const clamor_motion& given, SourceMotion& motion) {
  if (!read_vector(given.position_m, clamor::kMaxWorldCoordinate_m, motion.position_m) ||
      !read_vector(given.velocity_mps, kMaxSpeed_mps, motion.velocity_mps) ||
      !read_vector(given.axis, 1e3, motion.axis))
    return false;
  if (motion.axis == Vec3{}) motion.axis = {0, 0, -1};
  return length(motion.axis) > 1e-3;
}

bool read_group(const clamor_group_options* given, WorldGroup& group) {
  clamor_group_options options;
  if (given == nullptr || !copy_from_caller(given, options)) return false;
  if (options.max_voices == 0) options.max_voices = 1;
  if (options.has_gain == 0) options.gain = 1;
  group.gain = options.is_muted != 0 ? 0 : options.gain;
  group.paused = options.is_paused != 0;
  group.voice_share = options.max_voices;
  return options.gain >= 0 && options.gain <= clamor::kMaxWorldGain && options.max_voices > 0 &&
         options.max_voices <= 1;
}

// The result of reading the options of a source.
clamor_result read_source(clamor_context& context, const clamor_source_options* given,
                          WorldSource& source) {
  clamor_source_options options;
  if (given == nullptr || !copy_from_caller(given, options) ||
      !read_motion(options.motion, source.motion))
    return refuse(&context, given);
  if (options.gain == 0) options.gain = 1;
  if (options.has_reverberation == 0) options.reverberation = 1;
  if (!(options.gain > 0 && options.gain <= clamor::kMaxWorldGain) ||
      !(options.reverberation >= 0 && options.reverberation <= clamor::kMaxReverberation) ||
      !(options.played_s >= 0 && options.played_s <= kMaxPlayed_s))
    return CLAMOR_ERROR_ARGUMENT;
  bool has_bands = false;
  for (std::size_t b = 0; b < clamor::kBandCount; ++b) {
    if (!(options.band_gains[b] >= 0 &&
          options.band_gains[b] * options.gain <= clamor::kMaxWorldGain) ||
        !(options.directivity[b] >= 0 && options.directivity[b] <= kMaxExponent))
      return CLAMOR_ERROR_ARGUMENT;
    has_bands = has_bands || options.band_gains[b] > 0;
  }
  for (std::size_t b = 0; b < clamor::kBandCount; ++b) {
    source.gain[b] = static_cast<float>(options.gain * (has_bands ? options.band_gains[b] : 1));
    source.directivity[b] = static_cast<float>(options.directivity[b]);
  }
  source.sound = options.sound;
  source.group = options.group;
  source.level = options.level;
  source.reverberation = static_cast<float>(options.reverberation);
  source.played_s = options.played_s;
  source.ends_with_sound = options.ends_with_sound != 0;
  const WorldSources& sources = context.world.sources();
  const bool exist = sources.sound(source.sound) != nullptr &&
                     (source.group == 0 || sources.has_group(source.group)) &&
                     (source.level == 0 || context.world.level(source.level) != nullptr);
  return exist ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
}

clamor_result add_sound(clamor_context& context, std::shared_ptr<WorldSound> made,
                        clamor_sound* sound, clamor_error* error) {
  context.world.prepare(*made);
  return hand_out(context.world.sources().add(std::move(made)), sound, error);
}

clamor_result add_samples(clamor_context& context, Result<std::vector<float>> samples, bool loops,
                          clamor_sound* sound, clamor_error* error) {
  if (!samples.ok()) return fail(error, CLAMOR_ERROR_FILE, samples.error().message);
  return add_sound(context, std::make_shared<WorldSound>(Signal{"", std::move(*samples), loops}),
                   sound, error);
}

}  // namespace

extern "C" {

clamor_result clamor_add_sound(clamor_context* context, const float* samples, uint64_t frames,
                               const clamor_sound_options* options, clamor_sound* sound,
                               clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    clamor_sound_options chosen;
    constexpr std::uint64_t kMaxFrames = std::uint64_t{1} << 30;
    if (is_missing(context) || sound == nullptr || samples == nullptr || frames == 0 ||
        frames > kMaxFrames || !copy_from_caller(options, chosen))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(options));
    if (chosen.rate_hz == 0) chosen.rate_hz = clamor::kSampleRate_hz;
    const std::span given(samples, static_cast<std::size_t>(frames));
    for (const float sample : given)
      if (!(std::abs(sample) <= clamor::kMaxSample))
        return fail(error, CLAMOR_ERROR_ARGUMENT,
                    "a sample is not finite, or beyond a million times full scale");
    if (chosen.rate_hz > 1'000'000) return fail(error, CLAMOR_ERROR_ARGUMENT);
    auto at_48k = clamor::resampled(given, static_cast<int>(chosen.rate_hz));
    if (!at_48k.ok())
      return fail(error, CLAMOR_ERROR_ARGUMENT, "the sound " + at_48k.error().message);
    return add_samples(*context, std::move(at_48k), chosen.loops != 0, sound, error);
  });
}

clamor_result clamor_read_sound(clamor_context* context, const char* path,
                                const clamor_sound_options* options, clamor_sound* sound,
                                clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    clamor_sound_options chosen;
    if (is_missing(context) || sound == nullptr || path == nullptr ||
        !copy_from_caller(options, chosen))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(options));
    return add_samples(*context, clamor::read_audio(path), chosen.loops != 0, sound, error);
  });
}

clamor_result clamor_read_level_sound(clamor_context* context, clamor_level level, uint32_t index,
                                      clamor_sound* sound, clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    if (is_missing(context) || sound == nullptr) return fail(error, CLAMOR_ERROR_ARGUMENT);
    const auto file = context->world.level(level);
    if (file == nullptr) return fail(error, CLAMOR_ERROR_HANDLE);
    if (index >= file->signal_count()) return fail(error, CLAMOR_ERROR_ARGUMENT);
    auto signal = file->read_signal(index);
    if (!signal.ok()) return fail(error, CLAMOR_ERROR_FILE, signal.error().message);
    return add_sound(*context, std::make_shared<WorldSound>(std::move(*signal)), sound, error);
  });
}

clamor_result clamor_add_stream(clamor_context* context, const clamor_stream* stream,
                                clamor_sound* sound, clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    clamor_stream chosen;
    if (is_missing(context) || sound == nullptr || stream == nullptr ||
        !copy_from_caller(stream, chosen))
      return fail(error, CLAMOR_ERROR_ARGUMENT, size_refusal(stream));
    if (chosen.rate_hz == 0) chosen.rate_hz = clamor::kSampleRate_hz;
    if (chosen.rate_hz < kMinStreamRate_hz || chosen.rate_hz > kMaxStreamRate_hz)
      return fail(error, CLAMOR_ERROR_ARGUMENT, "a stream's rate lies between 8000 and 192000 Hz");
    if (chosen.pull == nullptr && chosen.release != nullptr)
      return fail(error, CLAMOR_ERROR_ARGUMENT, "a stream without pull has nothing to release");
    Loan loan(chosen.user, chosen.release);
    LiveFeed::Pull pull;
    if (chosen.pull != nullptr)
      pull = [owner = loan.owner(), call = chosen.pull,
              user = chosen.user](std::span<float> samples) {
        return std::size_t{call(user, samples.data(), static_cast<uint32_t>(samples.size()))};
      };
    auto feed = LiveFeed::create(static_cast<int>(chosen.rate_hz), std::move(pull));
    if (!feed.ok()) return fail(error, CLAMOR_ERROR_ARGUMENT, feed.error().message);
    return loan.keep_after(
        add_sound(*context, std::make_shared<WorldSound>(std::move(*feed)), sound, error));
  });
}

clamor_result clamor_write_stream(clamor_context* context, clamor_sound sound, const float* samples,
                                  uint32_t frames, uint32_t* taken) {
  if (is_missing(context) || samples == nullptr) return CLAMOR_ERROR_ARGUMENT;
  return entered(context->world.sources().written(), sound,
                 [=](WorldSound& written) noexcept -> clamor_result {
                   LiveFeed* const feed = written.feed();
                   if (feed == nullptr || !feed->is_ring()) return CLAMOR_ERROR_STATE;
                   const std::size_t count = feed->write({samples, frames});
                   if (taken != nullptr) *taken = static_cast<uint32_t>(count);
                   return CLAMOR_OK;
                 });
}

clamor_result clamor_remove_sound(clamor_context* context, clamor_sound sound) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.sources().remove_sound(sound) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_add_group(clamor_context* context, const clamor_group_options* options,
                               clamor_group* group) {
  return guarded(nullptr, [&]() -> clamor_result {
    WorldGroup made;
    if (is_missing(context) || group == nullptr || !read_group(options, made))
      return refuse(context, options);
    return hand_out(context->world.sources().add(made), group);
  });
}

clamor_result clamor_change_group(clamor_context* context, clamor_group group,
                                  const clamor_group_options* options) {
  return guarded(nullptr, [&]() -> clamor_result {
    WorldGroup changed;
    if (is_missing(context) || !read_group(options, changed)) return refuse(context, options);
    return context->world.sources().set_group(group, changed) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_remove_group(clamor_context* context, clamor_group group) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.sources().remove_group(group) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_add_source(clamor_context* context, const clamor_source_options* options,
                                clamor_source* source) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || source == nullptr) return CLAMOR_ERROR_ARGUMENT;
    WorldSource made;
    if (const auto read = read_source(*context, options, made); read != CLAMOR_OK) return read;
    return hand_out(context->world.sources().add(made), source);
  });
}

clamor_result clamor_change_source(clamor_context* context, clamor_source source,
                                   const clamor_source_options* options) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    WorldSource changed;
    if (const auto read = read_source(*context, options, changed); read != CLAMOR_OK) return read;
    return context->world.sources().change(source, changed) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_move_source(clamor_context* context, clamor_source source,
                                 const clamor_motion* motion) {
  return guarded(nullptr, [&]() -> clamor_result {
    SourceMotion moved;
    if (is_missing(context) || motion == nullptr || !read_motion(*motion, moved))
      return CLAMOR_ERROR_ARGUMENT;
    return context->world.sources().move(source, moved) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_remove_source(clamor_context* context, clamor_source source) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.sources().remove_source(source) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_commit(clamor_context* context, double time_s) {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || !(std::abs(time_s) <= clamor::kMaxWorldTime_s))
      return CLAMOR_ERROR_ARGUMENT;
    context->world.sources().commit({WorldSources::now_s(), time_s});
    return CLAMOR_OK;
  });
}

}  // extern "C"
