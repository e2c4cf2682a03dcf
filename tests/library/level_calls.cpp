// level_calls.cpp: calls about contexts and levels, see call_sequence.h.
#include <algorithm>

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
  const auto given = sequence.pick_structure(options, 1, true);
  clamor_context* made = nullptr;
  clamor_context** const into = sequence.draws.one_in(16) ? nullptr : &made;
  const double period_s = given.known.update_period_s;
  const bool is_valid = into != nullptr && given.is_valid && period_s >= 0 && period_s <= 0.1;
  const clamor_result result = clamor_create(given.pointer, into, sequence.pick_error());
  if (result != CLAMOR_OK && made != nullptr) broken("a context without success");
  if (result == CLAMOR_OK) {
    clamor_destroy(known.context);
    known = {made, given.known.caller_updates != 0, {}, {}, {}};
  }
  return {result, success_if(is_valid)};
}

CallOutcome update(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const double loading_s = sequence.draws.one_in(8) ? sequence.draws.odd_number() : 0;
  std::uint32_t made = 0;
  const bool is_valid = known != nullptr && known->caller_updates && loading_s >= 0;
  const clamor_result result =
      clamor_update(context, loading_s, sequence.draws.one_in(4) ? nullptr : &made);
  if (known != nullptr && made > 2 * known->listeners.size()) broken("too many keyframes");
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
      {"clamor_update", 20, {kArgument, kState, kMemory}, update},
      {"clamor_open_level", 3, {kArgument, kFile, kFull, kMemory}, open_level},
      {"clamor_open_level_with", 6, {kArgument, kFile, kFull, kMemory}, open_level_with},
      {"clamor_close_level", 4, {kArgument, kHandle}, close_level},
      {"clamor_get_level_info", 20, {kArgument, kHandle}, get_level_info},
      {"clamor_result_text", 2, {}, result_text},
  };
}

}  // namespace clamor::testing
