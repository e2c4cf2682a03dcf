#include "tests/library/call_sequence.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>

#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/library/call_helpers.h"
#include "tests/sofa_writer.h"

namespace clamor::testing {

namespace {

constexpr std::size_t kMaxCalls = 200;

const char* current_call = "";

constexpr std::uint32_t kMaxSources = 8, kMaxSounds = 6;  // so that contexts become full

// All that a caller can read of a context. Where the library has threads of its own, statistics
// change between two calls.
std::vector<std::uint64_t> state_of(const KnownContext& known) {
  std::vector<std::uint64_t> state;
  for (const auto* levels : {&known.levels, &known.damaged_levels})
    for (const clamor_level level : *levels) {
      clamor_level_info info{};
      info.bytes = sizeof(info);
      if (clamor_get_level_info(known.context, level, &info) != CLAMOR_OK)
        broken("an open level has no information");
      state.insert(state.end(), {info.emitters, info.sounds, info.sources});
    }
  for (const KnownListener& listener : known.listeners) {
    std::uint32_t channels = 0, wanted = 0;
    double time_s = 0;
    clamor_listener_statistics statistics{};
    statistics.bytes = sizeof(statistics);
    if (clamor_get_channels(known.context, listener.handle, &channels) != CLAMOR_OK ||
        clamor_next_keyframe(known.context, listener.handle, &wanted, &time_s) != CLAMOR_OK ||
        clamor_get_listener_statistics(known.context, listener.handle, &statistics) != CLAMOR_OK)
      broken("a listener cannot be asked about");
    if (channels != listener.channels) broken("a listener has other channels than at first");
    state.push_back(channels);
    if (!known.caller_updates) continue;
    state.insert(state.end(), {wanted, static_cast<std::uint64_t>(time_s * 1e6), statistics.voices,
                               statistics.keyframes, statistics.held_blocks, statistics.pages,
                               statistics.page_bytes, statistics.sound_bytes, statistics.failures,
                               statistics.unseen_sources});
  }
  // A sound is asked about by writing nothing to it.
  for (const KnownSound& sound : known.sounds) {
    const float none = 0;
    const clamor_result expected = sound.is_written ? CLAMOR_OK : CLAMOR_ERROR_STATE;
    if (clamor_write_stream(known.context, sound.handle, &none, 0, nullptr) != expected)
      broken("a sound has ended or is of another kind");
  }
  return state;
}

std::vector<std::uint64_t> state_of(const Sequence& sequence) {
  std::vector<std::uint64_t> state;
  for (const KnownContext& known : sequence.contexts) {
    if (known.context == nullptr) continue;
    const auto part = state_of(known);
    state.insert(state.end(), part.begin(), part.end());
  }
  return state;
}

void check_error(const clamor_error& error, clamor_result result) {
  if (error.code != result) broken("the clamor_error has another code than the result");
  const char* const end = error.sentence + sizeof(error.sentence);
  if (std::find(error.sentence, end, '\0') == end) broken("a sentence does not end");
  if ((error.sentence[0] == 0) != (result == CLAMOR_OK))
    broken("a sentence without an error, or an error without a sentence");
}

void check(const Call& call, const CallOutcome& outcome, const Sequence& sequence,
           const std::vector<std::uint64_t>& before) {
  const clamor_result result = outcome.result;
  if (result != CLAMOR_OK &&
      std::find(call.errors.begin(), call.errors.end(), result) == call.errors.end())
    broken("undocumented result " + std::to_string(result));
  if (outcome.expected == Expected::kSuccess && result != CLAMOR_OK)
    broken("failed with " + std::to_string(result) + " though its arguments are right: " +
           (sequence.has_error ? sequence.error.sentence : ""));
  if (outcome.expected == Expected::kError && result == CLAMOR_OK)
    broken("succeeded though its arguments are wrong");
  if (sequence.has_error) check_error(sequence.error, result);
  if (result != CLAMOR_OK && state_of(sequence) != before)
    broken("a failed call changed something");
}

// Sequences begin with these calls, so that most have something to hear.
constexpr std::string_view kFirstCalls[] = {
    "clamor_create_listener", "clamor_add_sound",  "clamor_add_stream", "clamor_add_source",
    "clamor_add_source",      "clamor_add_source", "clamor_commit",     "clamor_update"};

const Call& first_call(std::size_t number) {
  for (const Call& call : all_calls())
    if (call.name == kFirstCalls[number]) return call;
  broken("a first call has no entry");
}

const Call& pick_call(Draws& draws) {
  static const std::uint32_t weights =
      std::accumulate(all_calls().begin(), all_calls().end(), 0u,
                      [](std::uint32_t sum, const Call& call) { return sum + call.weight; });
  std::uint32_t drawn = (draws.byte() | draws.byte() << 8) % weights;
  for (const Call& call : all_calls()) {
    if (drawn < call.weight) return call;
    drawn -= call.weight;
  }
  return all_calls().back();
}

}  // namespace

std::span<const Call> all_calls() {
  static const std::vector<Call> calls = [] {
    std::vector<Call> all = level_calls();
    for (const auto& more : {listener_calls(), sound_calls(), source_calls(), emitter_calls(),
                             part_calls(), portal_calls()})
      all.insert(all.end(), more.begin(), more.end());
    return all;
  }();
  return calls;
}

bool makes_keyframes() {
  static constexpr std::string_view kMaking[] = {"clamor_update", "clamor_create_listener"};
  return std::find(std::begin(kMaking), std::end(kMaking), current_call) != std::end(kMaking);
}

void broken(const std::string& promise) {
  std::fprintf(stderr, "%s: %s\n", current_call, promise.c_str());
  std::abort();
}

std::uint8_t Draws::byte() {
  if (bytes_.empty()) return 0;
  const std::uint8_t first = bytes_.front();
  bytes_ = bytes_.subspan(1);
  return first;
}

std::uint64_t Draws::word() {
  std::uint64_t drawn = 0;
  for (int i = 0; i < 8; ++i) drawn = drawn << 8 | byte();
  return drawn;
}

double Draws::odd_number() {
  using Limits = std::numeric_limits<double>;
  const std::array numbers = {0.0,
                              -1.0,
                              1e-300,
                              1e9,
                              -1e9,
                              1e30,
                              1e300,
                              0.5,
                              Limits::max(),
                              Limits::infinity(),
                              -Limits::infinity(),
                              Limits::quiet_NaN(),
                              Limits::denorm_min()};
  return numbers[below(numbers.size())];
}

KnownContext* Sequence::pick_context(clamor_context*& pointer) {
  KnownContext& known = contexts[!is_beginning && draws.one_in(8) ? 1 : 0];
  pointer = draws.one_in(48) ? nullptr : known.context;
  return pointer == nullptr ? nullptr : &known;
}

std::uint64_t Sequence::wrong_handle() {
  switch (draws.below(4)) {
    case 0:
      return draws.word();
    case 1:
      return draws.below(4);
    default: {  // stale, foreign or of another kind, and sometimes with a wrong bit
      if (handles.empty()) return 0;
      const std::uint64_t given = handles[draws.below(static_cast<std::uint32_t>(handles.size()))];
      return draws.one_in(4) ? given ^ std::uint64_t{1} << draws.below(64) : given;
    }
  }
}

Picked Sequence::pick_level(const KnownContext* context) {
  if (context == nullptr || draws.one_in(12)) {
    const std::uint64_t handle = wrong_handle();
    return {handle, context != nullptr && has_level(*context, handle)};
  }
  const auto& levels =
      draws.one_in(8) || context->levels.empty() ? context->damaged_levels : context->levels;
  if (levels.empty()) return {};
  return {levels[draws.below(static_cast<std::uint32_t>(levels.size()))], true};
}

clamor_error* Sequence::pick_error() {
  has_error = !draws.one_in(3);
  std::memset(&error, 0x5a, sizeof(error));
  return has_error ? &error : nullptr;
}

clamor_pose Sequence::pick_pose(bool& is_valid) {
  clamor_pose pose{{1 + draws.byte() / 64.0, 1 + draws.byte() / 43.0, draws.byte() / 86.0},
                   {0.1, draws.byte() / 128.0 - 1, 0, 1}};
  if (draws.one_in(8)) {
    double* const numbers[] = {&pose.position_m[0],  &pose.position_m[1],  &pose.position_m[2],
                               &pose.orientation[0], &pose.orientation[1], &pose.orientation[2],
                               &pose.orientation[3]};
    for (std::uint32_t i = 1 + draws.below(3); i > 0; --i)
      *numbers[draws.below(7)] = draws.odd_number();
  }
  const auto is_in_range = [](double number) { return std::abs(number) <= 1e9; };
  double square = 0;
  for (const double part : pose.orientation) square += part * part;
  is_valid = std::all_of(pose.position_m, pose.position_m + 3, is_in_range) &&
             std::all_of(pose.orientation, pose.orientation + 4, is_in_range) && square > 1e-12;
  return pose;
}

std::size_t make_call_sequence(std::span<const std::uint8_t> bytes) {
  std::size_t count = 0;
  Sequence sequence(bytes);
  for (std::size_t i = 0; i < sequence.contexts.size(); ++i) {
    KnownContext& known = sequence.contexts[i];
    clamor_options options{};
    options.bytes = sizeof(options);
    options.caller_updates = known.caller_updates = !sequence.draws.one_in(16);
    options.max_sources = known.max_sources = kMaxSources;
    options.max_sounds = known.max_sounds = kMaxSounds;
    options.log = [](void*, const char* sentence) {
      if (sentence == nullptr || sentence[0] == 0) broken("nothing is told to the log");
    };
    if (clamor_create(&options, &known.context, nullptr) != CLAMOR_OK) broken("clamor_create()");
    clamor_level level = 0;
    if (clamor_open_level(known.context, bake_path().c_str(), &level, nullptr) != CLAMOR_OK)
      broken("clamor_open_level()");
    known.levels.push_back(level);
    sequence.handles.push_back(level);
  }
  while (!sequence.draws.empty() && count < kMaxCalls) {
    sequence.is_beginning = count < std::size(kFirstCalls);
    const Call& call = sequence.is_beginning ? first_call(count) : pick_call(sequence.draws);
    current_call = call.name;
    sequence.has_error = false;
    const auto before = state_of(sequence);
    const CallOutcome outcome = call.make(sequence);
    check(call, outcome, sequence, before);
    ++count;
  }
  current_call = "the end of the sequence";
  for (const KnownContext& known : sequence.contexts) remove_all_sources(known);
  current_call = "clamor_destroy";
  for (const KnownContext& known : sequence.contexts) clamor_destroy(known.context);
  for (const Archive& archive : sequence.archives)
    if (archive.releases != (archive.expects_release ? 1 : 0))
      broken("a level was released " + std::to_string(archive.releases) + " times");
  for (const PulledStream& stream : sequence.pulled_streams)
    if (stream.releases != (stream.expects_release ? 1 : 0))
      broken("a stream was released " + std::to_string(stream.releases) + " times");
  return count;
}

const std::string& bake_path() {
  static const std::string path = [] {
    std::string empty = fuzz::file_with("", "_room.clamor");
    const Portal door{"Door", {3, 4, 1.5}, {0, 4, 0}, {0, 0, 1.5}};
    BakeContents contents = baked_contents(60, {door});
    contents.movable_parts = {{"door", box_mesh({0.02, 0.5, 1}, 0), {{3, 4, 1}}}};
    if (!write_bake(empty, contents, 1).ok()) broken("the room cannot be written");
    return empty;
  }();
  return path;
}

const std::vector<std::byte>& bake_bytes() {
  static const std::vector<std::byte> bytes = [] {
    std::ifstream file(bake_path(), std::ios::binary);
    const std::vector<char> read((std::istreambuf_iterator<char>(file)),
                                 std::istreambuf_iterator<char>());
    const auto all = std::as_bytes(std::span(read));
    return std::vector<std::byte>(all.begin(), all.end());
  }();
  return bytes;
}

const std::string& damaged_path() {
  static const std::string path = fuzz::file_with(
      std::string(reinterpret_cast<const char*>(bake_bytes().data()), 1000), "_cut.clamor");
  return path;
}

const std::string& head_path() {
  static const std::string path = [] {
    return fuzz::file_with(SofaWriter(plain_head(48'000, 16, 64)).bytes(), "_head.sofa");
  }();
  return path;
}

}  // namespace clamor::testing
