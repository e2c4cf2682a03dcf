// call_sequence.h: random sequences of calls of the C interface, decoded from bytes, and the checks
// that hold after every call whatever its arguments were.
//
// Each call draws its arguments from the bytes: handles that are valid, stale, foreign, invented or
// of another kind, structures of odd sizes, numbers that are huge or not finite, null pointers, and
// levels that are damaged or stop being readable. The call then knows whether it has to succeed. In
// addition, every code is one that clamor.h documents for the function, a failed call leaves its
// results and all objects as they were, and no level is released twice or kept.
//
// A new function of the interface needs one entry in a table of *_calls.cpp, which
// clamor_sequences_test.cpp checks. A broken promise aborts the program with a message, so
// libFuzzer (tests/fuzz/interface_fuzz.cpp) and GoogleTest both see it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/clamor.h"

namespace clamor::testing {

// Decodes one sequence, makes its calls and returns how many there were.
std::size_t make_call_sequence(std::span<const std::uint8_t> bytes);

// Prints the promise that was broken and aborts.
[[noreturn]] void broken(const std::string& promise);

// The bytes that decide everything; zeros once they have been used up.
class Draws {
 public:
  explicit Draws(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  std::uint8_t byte();
  std::uint32_t below(std::uint32_t count) { return byte() % count; }
  bool one_in(std::uint32_t count) { return below(count) == count - 1; }
  std::uint64_t word();
  // A number of a kind that is easily mistaken: zero, negative, tiny, huge, infinite or none.
  double odd_number();

 private:
  std::span<const std::uint8_t> bytes_;
};

// A structure that begins with `bytes`, on the heap and exactly as long as it says, so that
// AddressSanitizer sees each access beyond it.
template <class T>
struct Structure {
  std::unique_ptr<unsigned char[]> memory;
  T* pointer = nullptr;  // null if the call gets no structure
  std::size_t bytes = 0;
  bool is_valid = true;  // as far as its size and the members behind the known ones go
  T known{};             // as the library should understand it

  bool equals(const std::vector<unsigned char>& before) const {
    return std::equal(before.begin(), before.end(), memory.get());
  }
};

// A level whose bytes the test supplies.
struct Archive {
  std::vector<std::byte> bytes;
  std::size_t reads_until_failure = SIZE_MAX;
  std::atomic<std::size_t> reads{0};
  std::atomic<int> releases{0};
  bool expects_release = false;
};

// What a stream's pull callback does.
enum class PullKind : std::uint8_t { kAll, kHalf, kNone, kMoreThanAsked, kOddSamples };

// Its context may pull it on a thread of its own.
struct PulledStream {
  PullKind kind = PullKind::kAll;
  bool caller_updates = true;
  std::atomic<bool> has_ended{false};  // it must not be pulled any more
  std::atomic<int> releases{0};
  bool expects_release = false;
};

struct KnownListener {
  clamor_listener handle = 0;
  std::uint32_t channels = 0;
  bool reports_voices = false, is_silent = false;
};

struct KnownSound {
  clamor_sound handle = 0;
  bool is_written = false;         // a stream without a callback
  PulledStream* pulled = nullptr;  // a stream with one
};

struct KnownSource {
  clamor_source handle = 0;
  clamor_sound sound = 0;
  bool ends_with_sound = false;
  clamor_motion motion{};
};

struct KnownPart {
  clamor_part handle = 0;
  clamor_level level = 0;  // of a level's part
  bool is_added = false;
};

// The expected contents of one context.
struct KnownContext {
  clamor_context* context = nullptr;
  bool caller_updates = false;
  std::uint32_t max_sources = 0, max_sounds = 0;
  std::vector<clamor_level> levels{}, damaged_levels{};
  std::vector<KnownListener> listeners{};
  std::vector<KnownSound> sounds{};
  std::vector<PulledStream*> removed_streams{};  // since the last commit
  std::vector<clamor_group> groups{};
  std::vector<KnownSource> sources{};
  std::vector<KnownPart> parts{};
};

inline std::uint64_t handle_of(std::uint64_t handle) { return handle; }
template <class Known>
std::uint64_t handle_of(const Known& known) {
  return known.handle;
}

// The object of a handle, or null.
template <class Known>
Known* find(std::vector<Known>& all, std::uint64_t handle) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [=](const Known& one) { return handle_of(one) == handle; });
  return found == all.end() ? nullptr : &*found;
}
template <class Known>
const Known* find(const std::vector<Known>& all, std::uint64_t handle) {
  return find(const_cast<std::vector<Known>&>(all), handle);
}
// Whether a level is open.
inline bool has_level(const KnownContext& context, clamor_level level) {
  return find(context.levels, level) != nullptr || find(context.damaged_levels, level) != nullptr;
}

struct Picked {
  std::uint64_t handle = 0;
  bool is_valid = false;
};

enum class Expected : std::uint8_t { kSuccess, kError, kEither };

struct CallOutcome {
  clamor_result result = CLAMOR_OK;
  Expected expected = Expected::kEither;
};

inline Expected success_if(bool valid) { return valid ? Expected::kSuccess : Expected::kError; }

struct Sequence {
  explicit Sequence(std::span<const std::uint8_t> bytes) : draws(bytes) {}

  // One of the contexts; null at times. `pointer` goes to the call.
  KnownContext* pick_context(clamor_context*& pointer);
  // Handles for a call in `context`, which may be null.
  Picked pick_level(const KnownContext* context);
  template <class Known>
  Picked pick(const KnownContext* context, std::vector<Known> KnownContext::*objects);
  Picked pick_listener(const KnownContext* context) {
    return pick(context, &KnownContext::listeners);
  }
  // A handle that is stale, foreign, invented or of another kind. It may be valid by chance.
  std::uint64_t wrong_handle();
  // Null at times, otherwise filled with what no call writes.
  clamor_error* pick_error();
  clamor_pose pick_pose(bool& is_valid);

  // `filled` with a size that is right, shorter or longer; multiples of `step` bytes.
  template <class T>
  Structure<T> pick_structure(T filled, std::size_t step, bool may_be_null);

  Draws draws;
  std::array<KnownContext, 2> contexts;
  std::vector<std::uint64_t> handles;  // all that were ever given out
  std::list<Archive> archives;
  std::list<PulledStream> pulled_streams;
  clamor_error error{};
  bool has_error = false;     // the current call got &error
  bool is_beginning = false;  // all calls are in the first context
};

// A function of the interface.
struct Call {
  const char* name;
  std::uint32_t weight;  // calls are drawn in proportion to it
  std::vector<clamor_result> errors;
  CallOutcome (*make)(Sequence&);
};
std::span<const Call> all_calls();

// A small bake, and files that the calls open.
const std::vector<std::byte>& bake_bytes();
const std::string& bake_path();
const std::string& damaged_path();
const std::string& head_path();

// Whether keyframes may be made in the current call, if the context has no thread of its own.
bool makes_keyframes();

constexpr std::uint64_t kUntouched = 0x5a5a5a5a5a5a5a5a;

template <class Known>
Picked Sequence::pick(const KnownContext* context, std::vector<Known> KnownContext::*objects) {
  if (context == nullptr) return {wrong_handle(), false};
  const std::vector<Known>& all = context->*objects;
  if (all.empty() || draws.one_in(12)) {
    const std::uint64_t handle = wrong_handle();
    return {handle, find(all, handle) != nullptr};
  }
  return {handle_of(all[draws.below(static_cast<std::uint32_t>(all.size()))]), true};
}

template <class T>
Structure<T> Sequence::pick_structure(T filled, std::size_t step, bool may_be_null) {
  Structure<T> made;
  if (draws.one_in(32)) {
    made.is_valid = may_be_null;
    return made;
  }
  std::size_t bytes = sizeof(T);
  const std::uint32_t kind = draws.below(16);
  if (kind == 13) bytes = draws.below(sizeof(T) / step) * step;
  if (kind >= 14) bytes += (1 + draws.below(4)) * 8;
  const std::size_t room = std::max(bytes, sizeof(filled.bytes));
  made.memory = std::make_unique<unsigned char[]>(room);
  filled.bytes = static_cast<std::uint32_t>(bytes);
  std::memcpy(made.memory.get(), &filled, std::min(room, sizeof(T)));
  if (kind == 15) made.memory[bytes - 1] = 1;  // a member of a later version
  made.pointer = reinterpret_cast<T*>(made.memory.get());
  made.bytes = room;
  made.is_valid = bytes >= sizeof(filled.bytes) && kind != 15;
  std::memcpy(&made.known, made.memory.get(), std::min(room, sizeof(T)));
  return made;
}

}  // namespace clamor::testing
