// level_calls.cpp: calls about contexts and levels, see call_sequence.h.
#include <algorithm>
#include <cmath>

#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

constexpr std::size_t kMaxLevels = 6;  // so that a sequence stays quick

void forget(std::vector<clamor_level>& levels, clamor_level level) { std::erase(levels, level); }

CallOutcome create(Sequence& sequence) {
  // The second context is replaced, because all of its handles become foreign ones.
  KnownContext& known = sequence.contexts[1];
  clamor_options options{};
  options.caller_updates = !sequence.draws.one_in(16);
  if (sequence.draws.one_in(4)) options.update_period_s = sequence.draws.odd_number();
  static constexpr std::uint32_t kCounts[] = {1, 8, 0, 4096, 4097, 65'536, 65'537, UINT32_MAX};
  options.max_sources = options.max_sounds = 5;
  if (sequence.draws.one_in(8)) options.max_sources = kCounts[sequence.draws.below(8)];
  if (sequence.draws.one_in(8)) options.max_sounds = kCounts[sequence.draws.below(8)];
  const auto given = sequence.pick_structure(options, 1, true);
  clamor_context* made = nullptr;
  clamor_context** const into = sequence.draws.one_in(16) ? nullptr : &made;
  const double period_s = given.known.update_period_s;
  const std::uint32_t sources = given.known.max_sources, sounds = given.known.max_sounds;
  const bool is_valid = into != nullptr && given.is_valid && is_within(period_s, 0, 0.1) &&
                        sources <= 65'536 && sounds <= 4096;
  const clamor_result result = clamor_create(given.pointer, into, sequence.pick_error());
  if (result != CLAMOR_OK && made != nullptr) broken("a context without success");
  if (result == CLAMOR_OK) {
    clamor_destroy(known.context);
    for (const KnownSound& sound : known.sounds)
      if (sound.pulled != nullptr) sound.pulled->has_ended = true;
    known = {.context = made,
             .caller_updates = given.known.caller_updates != 0,
             .max_sources = sources != 0 ? sources : 1024,
             .max_sounds = sounds != 0 ? sounds : 256};
  }
  return {result, success_if(is_valid)};
}

CallOutcome update(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const double loading_s = sequence.draws.one_in(8) ? sequence.draws.odd_number() : 0;
  constexpr std::uint32_t kUnwritten = 99;
  std::uint32_t made = kUnwritten;
  const bool is_valid = known != nullptr && known->caller_updates && loading_s >= 0;
  std::uint32_t* const into = sequence.draws.one_in(4) ? nullptr : &made;
  const clamor_result result = clamor_update(context, loading_s, into);
  if (result != CLAMOR_OK && made != kUnwritten) broken("a failed call wrote");
  if (result == CLAMOR_OK && into == nullptr) made = 0;
  if (result == CLAMOR_OK && known != nullptr && made > 2 * known->listeners.size())
    broken("too many keyframes");
  return {result, success_if(is_valid)};
}

CallOutcome open_level(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  static const std::string folder = "/", none, missing = "/no/such/\xff level.clamor";
  const std::string* const paths[] = {&bake_path(), &bake_path(), &bake_path(), &damaged_path(),
                                      &folder,      &none,        &missing,     nullptr};
  const std::string* const path = paths[sequence.draws.below(8)];
  clamor_level level = kUntouched;
  clamor_level* const into = sequence.draws.one_in(16) ? nullptr : &level;
  if (known != nullptr && known->levels.size() >= kMaxLevels) context = nullptr;
  const bool is_valid = context != nullptr && into != nullptr && path == &bake_path();
  const clamor_result result = clamor_open_level(context, path == nullptr ? nullptr : path->c_str(),
                                                 into, sequence.pick_error());
  if (result == CLAMOR_OK) {
    remember(sequence, level);
    known->levels.push_back(level);
  } else {
    expect_untouched(level);
  }
  return {result, success_if(is_valid)};
}

int32_t read_archive(void* user, uint64_t offset, uint64_t count, void* into) {
  Archive& archive = *static_cast<Archive*>(user);
  if (++archive.reads > archive.reads_until_failure) return 7;
  if (offset > archive.bytes.size() || count > archive.bytes.size() - offset) return 1;
  std::memcpy(into, archive.bytes.data() + offset, count);
  return 0;
}

// The bytes are gone when they are released, so that AddressSanitizer sees later reads.
void release_archive(void* user) {
  Archive& archive = *static_cast<Archive*>(user);
  ++archive.releases;
  archive.bytes = {};
}

// Damages the archive in one way of several; false if it is whole.
bool damage(Draws& draws, Archive& archive) {
  std::vector<std::byte>& bytes = archive.bytes;
  const std::size_t at = draws.word() % bytes.size();
  switch (draws.below(6)) {
    case 0:
      bytes[at] ^= std::byte{static_cast<unsigned char>(1 + draws.below(255))};
      return true;
    case 1:
      bytes.resize(at);
      return true;
    case 2:
      archive.reads_until_failure = draws.below(64);
      return true;
    default:
      return false;
  }
}

CallOutcome open_level_with(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  Draws& draws = sequence.draws;
  Archive& archive = sequence.archives.emplace_back();
  archive.bytes = bake_bytes();
  const bool is_damaged = damage(draws, archive);
  clamor_reader reader{};
  reader.name = draws.one_in(4) ? nullptr : "an archive";
  reader.size = archive.bytes.size();
  reader.user = &archive;
  reader.release = draws.one_in(8) ? nullptr : release_archive;
  if (!draws.one_in(16)) {
    if (draws.one_in(2))
      reader.memory = archive.bytes.data();
    else
      reader.read = read_archive;
  }
  const bool lies = reader.memory == nullptr && draws.one_in(8);
  if (lies) reader.size = draws.one_in(2) ? draws.word() : reader.size + 1;
  const auto given = sequence.pick_structure(reader, 8, false);
  clamor_level level = kUntouched;
  clamor_level* const into = draws.one_in(16) ? nullptr : &level;
  if (known != nullptr && known->damaged_levels.size() >= kMaxLevels) context = nullptr;
  const bool has_bytes = given.known.read != nullptr || given.known.memory != nullptr;
  const bool is_valid =
      context != nullptr && into != nullptr && given.pointer != nullptr && given.is_valid;
  const clamor_result result =
      clamor_open_level_with(context, given.pointer, into, sequence.pick_error());
  if (result == CLAMOR_OK) {
    remember(sequence, level);
    // Not all damage shows at once, so all levels of archives count as damaged.
    known->damaged_levels.push_back(level);
    archive.expects_release = given.known.release != nullptr;
  } else {
    expect_untouched(level);
    archive.bytes = {};
  }
  const bool may_fail = is_damaged || lies || given.known.size != archive.bytes.size();
  if (is_valid && has_bytes && may_fail) return {result, Expected::kEither};
  return {result, success_if(is_valid && has_bytes)};
}

CallOutcome close_level(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked level = sequence.pick_level(known);
  const clamor_result result = clamor_close_level(context, level.handle);
  if (result == CLAMOR_OK && known != nullptr) {
    forget(known->levels, level.handle);
    forget(known->damaged_levels, level.handle);
    std::erase_if(known->parts, [&](const KnownPart& part) {
      return !part.is_added && part.level == level.handle;
    });
  }
  return {result, success_if(level.is_valid)};
}

CallOutcome get_level_info(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked level = sequence.pick_level(sequence.pick_context(context));
  return get_structure<clamor_level_info>(sequence, level, [&](clamor_level handle, auto* info) {
    return clamor_get_level_info(context, handle, info);
  });
}

// Short responses at few places, because every call reads all of the level's sources.
CallOutcome measure_responses(Sequence& sequence) {
  constexpr float kSample = 77;  // what no call writes
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  Draws& draws = sequence.draws;
  const Picked level = sequence.pick_level(known);
  static constexpr std::uint32_t kEmitters[] = {UINT32_MAX, 0, 1, 2, 3, UINT32_MAX - 1};
  const std::uint32_t emitter = kEmitters[draws.below(6)], places = draws.below(3);
  std::uint64_t frames = draws.below(4) * 1000;
  std::vector<double> positions_m;
  for (std::uint32_t i = 0; i < 3 * places; ++i)
    positions_m.push_back(draws.one_in(32) ? draws.odd_number() : 1 + draws.byte() / 128.0);
  std::vector<float> samples(places * frames + 1, kSample);
  if (places == 0) positions_m.push_back(0);
  std::uint64_t whole_frames = kUntouched;
  const bool has_positions = !draws.one_in(16), has_samples = !draws.one_in(16);
  if (!has_samples && draws.one_in(2)) frames = UINT64_MAX;
  std::uint64_t* const into = draws.one_in(4) ? nullptr : &whole_frames;
  const clamor_result result = clamor_measure_responses(
      context, level.handle, emitter, has_positions ? positions_m.data() : nullptr, places,
      has_samples ? samples.data() : nullptr, frames, into, sequence.pick_error());
  if (result != CLAMOR_OK) expect_untouched(whole_frames);
  if (samples.back() != kSample) broken("samples are written beyond their end");
  samples.pop_back();
  for (const float sample : samples)
    if (result == CLAMOR_OK ? !std::isfinite(sample) : sample != kSample)
      broken(result == CLAMOR_OK ? "a sample is not finite" : "a failed call wrote samples");
  const bool is_valid = level.is_valid && has_positions && has_samples &&
                        (emitter < kLevelEmitters || emitter == UINT32_MAX) &&
                        std::all_of(positions_m.begin(), positions_m.end(),
                                    [](double metre) { return is_within(metre, -1e9, 1e9); });
  const bool may_fail = known != nullptr && find(known->damaged_levels, level.handle) != nullptr;
  return {result, is_valid && may_fail ? Expected::kEither : success_if(is_valid)};
}

CallOutcome result_text(Sequence& sequence) {
  const auto code = static_cast<clamor_result>(sequence.draws.word());
  for (const clamor_result one : {code, clamor_result{-static_cast<int>(sequence.draws.below(12))}})
    if (clamor_result_text(one) == nullptr || clamor_result_text(one)[0] == 0)
      broken("a code has no text");
  if (clamor_abi_version() != CLAMOR_ABI_VERSION || clamor_version() == 0) broken("no version");
  return {CLAMOR_OK, Expected::kSuccess};
}

}  // namespace

std::vector<Call> level_calls() {
  return {
      {"clamor_create", 1, {kArgument, kMemory}, create},
      {"clamor_update", 40, {kArgument, kState, kMemory}, update},
      {"clamor_open_level", 3, {kArgument, kFile, kFull, kMemory}, open_level},
      {"clamor_open_level_with", 6, {kArgument, kFile, kFull, kMemory}, open_level_with},
      {"clamor_close_level", 4, {kArgument, kHandle}, close_level},
      {"clamor_get_level_info", 10, {kArgument, kHandle}, get_level_info},
      {"clamor_measure_responses", 1, {kHandle, kArgument, kFile, kMemory}, measure_responses},
      {"clamor_result_text", 2, {}, result_text},
  };
}

}  // namespace clamor::testing
