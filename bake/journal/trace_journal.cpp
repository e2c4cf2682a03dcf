#include "bake/journal/trace_journal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bake/journal/journal_file.h"
#include "common/cpu_time.h"
#include "common/platform/process.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMaxNoteBytes = 1 << 20;

// Header of a run in a record. The headers of all runs come first, then the powers that have
// arrived at the materials that they met, then their deposits.
struct StoredRun {
  std::uint64_t key = 0;
  std::uint32_t photons = 0, deposits = 0;
  TraceTally tally;
  std::uint32_t materials = 0, unused = 0;
};
static_assert(std::is_trivially_copyable_v<StoredRun>);
static_assert(std::is_trivially_copyable_v<ArrivedPower> && sizeof(ArrivedPower) == 36);

static_assert(std::is_trivially_copyable_v<Deposit>);

bool is_valid(const Deposit& deposit, std::size_t materials, std::size_t portals,
              std::uint32_t photons) {
  bool valid = is_finite(Vec3(deposit.position_m)) && is_finite(Vec3(deposit.normal)) &&
               is_finite(Vec3(deposit.mirror)) && deposit.delay_s >= 0 && deposit.delay_s < 1e6f &&
               deposit.random > 0 && deposit.random <= 1 && deposit.material < materials &&
               deposit.photon < photons && deposit.portals.is_valid(portals);
  for (const float power : deposit.power) valid = valid && power >= 0 && power < 1e30f;
  return valid;
}

bool is_valid(const ArrivedPower& arrived, std::size_t materials) {
  return arrived.material < materials && std::ranges::all_of(arrived.power, [](float power) {
           return power >= 0 && power < std::numeric_limits<float>::max();
         });
}

// Copies the elements [first, first + count) of a list that begins at `bytes`.
template <class T>
std::vector<T> elements_at(std::span<const std::byte> bytes, std::uint64_t first,
                           std::size_t count) {
  std::vector<T> elements(count);
  if (count > 0) std::memcpy(elements.data(), bytes.data() + first * sizeof(T), count * sizeof(T));
  return elements;
}

// The run headers of a record, or nothing if its count exceeds its size.
std::optional<std::vector<StoredRun>> runs_of(const JournalFile::Record& record) {
  if (record.count > record.bytes.size() / sizeof(StoredRun)) return std::nullopt;
  std::vector<StoredRun> runs(record.count);
  if (!runs.empty()) std::memcpy(runs.data(), record.bytes.data(), runs.size() * sizeof(StoredRun));
  return runs;
}

// The text of a record without runs, or nothing.
std::optional<std::string> text_of(const JournalFile::Record& record) {
  if (record.count != 0 || record.bytes.size() > kMaxNoteBytes) return std::nullopt;
  return std::string(reinterpret_cast<const char*>(record.bytes.data()), record.bytes.size());
}

std::string name_of_host() {
  const std::string name = host_name();
  return name.empty() ? "unknown" : name;
}

}  // namespace

struct TraceJournal::State {
  using Clock = std::chrono::steady_clock;
  static constexpr auto kTellEvery = std::chrono::seconds(1);

  struct Place {
    std::uint64_t record = 0;  // offset of the record
    std::uint32_t run = 0;     // index within the record
  };

  JournalFile file;
  std::size_t materials = 0, portals = 0;
  std::uint64_t damaged = 0;
  std::unordered_map<std::uint64_t, Place> places;  // by run key
  std::unordered_set<std::uint64_t> used;           // offsets of records
  std::string note;
  std::uint64_t note_record = 0;  // offset of the note's record; 0: none
  bool only_read = false;
  bool tells_progress = false;
  ShardProgress progress;
  Clock::time_point opened = Clock::now(), told = opened;
  double opened_core_s = process_time_s(), core_before_s = 0;

  // Stores how far the shard is, if that is wanted.
  Result<void> store_progress() {
    if (!tells_progress) return {};
    told = Clock::now();
    progress.core_s = core_before_s + process_time_s() - opened_core_s;
    progress.seconds = std::chrono::duration<double>(told - opened).count();
    const std::string text = progress.text();
    const auto record = file.append(0, std::as_bytes(std::span(text)));
    return record.ok() ? Result<void>() : Result<void>(record.error());
  }

  // Opens the file, collects the keys of all records and leaves out an incomplete last one.
  static Result<TraceJournal> open(const std::string& path, std::size_t materials,
                                   std::size_t portals, bool only_read) {
    auto state = std::make_unique<State>();
    state->materials = materials;
    state->portals = portals;
    state->only_read = only_read;
    const auto opened = only_read ? state->file.open_to_read(path) : state->file.open(path);
    if (!opened.ok()) return opened.error();
    if (const auto indexed = state->index(); !indexed.ok()) return indexed.error();
    return TraceJournal(std::move(state));
  }

  Result<void> index() {
    const std::uint64_t end = file.for_each([&](std::uint64_t offset) {
      const auto record = file.read(offset);
      const auto runs = record ? runs_of(*record) : std::nullopt;
      if (!runs) {
        ++damaged;
      } else if (const auto text = text_of(*record)) {
        if (const auto before = ShardProgress::from(*text)) {
          progress.before_s = before->before_s + before->seconds;
          core_before_s = before->core_s;
        } else {
          note = *text;
          note_record = offset;
        }
      }
      for (std::uint32_t i = 0; runs && i < runs->size(); ++i) places[(*runs)[i].key] = {offset, i};
    });
    file.release();
    return file.truncate_at(end);
  }
};

TraceJournal::TraceJournal(std::unique_ptr<State> state) : state_(std::move(state)) {}
TraceJournal::TraceJournal(TraceJournal&&) noexcept = default;
TraceJournal& TraceJournal::operator=(TraceJournal&&) noexcept = default;
TraceJournal::~TraceJournal() = default;

Result<TraceJournal> TraceJournal::open(const std::string& path, std::size_t materials,
                                        std::size_t portals) {
  return State::open(path, materials, portals, false);
}

Result<TraceJournal> TraceJournal::open_to_read(const std::string& path, std::size_t materials,
                                                std::size_t portals) {
  return State::open(path, materials, portals, true);
}

void TraceJournal::tell_progress() {
  state_->tells_progress = true;
  state_->progress.host = name_of_host();
}

const std::string& TraceJournal::note() const { return state_->note; }

Result<void> TraceJournal::set_note(const std::string& note) {
  assert(note.size() <= kMaxNoteBytes);
  if (state_->progress.photons > 0)
    if (const auto told = state_->store_progress(); !told.ok()) return told;
  if (note == state_->note) return {};
  const auto record = state_->file.append(0, std::as_bytes(std::span(note)));
  if (!record.ok()) return record.error();
  state_->note = note;
  state_->note_record = *record;
  return {};
}

bool TraceJournal::find(std::uint64_t key, const PhotonRun& run, TracedRuns& result) {
  const auto found = state_->places.find(key);
  if (found == state_->places.end()) return false;
  const auto [offset, index] = found->second;
  const auto give_up = [&] {
    ++state_->damaged;
    state_->places.erase(key);
    return false;
  };
  const auto record = state_->file.read(offset);
  const auto runs = record ? runs_of(*record) : std::nullopt;
  if (!runs || index >= runs->size()) return give_up();

  const StoredRun& stored = (*runs)[index];
  std::uint64_t first = 0, all = 0, first_met = 0, all_met = 0;
  for (std::uint32_t i = 0; i < runs->size(); ++i) {
    if (i == index) first = all, first_met = all_met;
    all += (*runs)[i].deposits;
    all_met += (*runs)[i].materials;
  }
  const std::size_t start = runs->size() * sizeof(StoredRun);
  if (stored.key != key || stored.photons != run.count ||
      start + all_met * sizeof(ArrivedPower) + all * sizeof(Deposit) != record->bytes.size())
    return give_up();

  const auto behind_headers = record->bytes.subspan(start);
  auto arrived = elements_at<ArrivedPower>(behind_headers, first_met, stored.materials);
  for (const ArrivedPower& power : arrived)
    if (!is_valid(power, state_->materials)) return give_up();
  auto deposits = elements_at<Deposit>(behind_headers.subspan(all_met * sizeof(ArrivedPower)),
                                       first, stored.deposits);
  for (Deposit& deposit : deposits) {
    if (!is_valid(deposit, state_->materials, state_->portals, run.count)) return give_up();
    deposit.emitter = run.emitter;  // indices change when emitters are added or removed
  }
  result.append(run, stored.tally, deposits, std::move(arrived));
  if (!state_->only_read) state_->used.insert(offset);
  state_->progress.photons += run.count;
  return true;
}

void TraceJournal::set_error_db(double error_db) { state_->progress.error_db = error_db; }
void TraceJournal::release() { state_->file.release(); }

Result<void> TraceJournal::append(std::span<const std::uint64_t> keys, const TracedRuns& traced) {
  std::size_t met = 0;
  for (const TracedRun& run : traced.runs()) met += run.arrived.size();
  std::vector<std::byte> payload(traced.runs().size() * sizeof(StoredRun) +
                                 met * sizeof(ArrivedPower) +
                                 traced.deposits().size() * sizeof(Deposit));
  std::byte* at = payload.data();
  const auto put = [&](std::span<const std::byte> bytes) {
    if (!bytes.empty()) std::memcpy(at, bytes.data(), bytes.size());
    at += bytes.size();
  };
  for (std::size_t i = 0; i < traced.runs().size(); ++i) {
    const TracedRun& run = traced.runs()[i];
    const StoredRun stored{keys[i], run.run.count, static_cast<std::uint32_t>(run.deposits),
                           run.tally, static_cast<std::uint32_t>(run.arrived.size())};
    put(std::as_bytes(std::span(&stored, 1)));
  }
  for (const TracedRun& run : traced.runs()) put(std::as_bytes(std::span(run.arrived)));
  for (const TracedRun& run : traced.runs()) put(std::as_bytes(traced.deposits_of(run)));

  const auto runs = static_cast<std::uint32_t>(traced.runs().size());
  const auto record = state_->file.append(runs, payload);
  if (!record.ok()) return record.error();
  for (std::uint32_t i = 0; i < runs; ++i) state_->places[keys[i]] = {*record, i};
  state_->used.insert(*record);
  for (const TracedRun& run : traced.runs()) {
    state_->progress.photons += run.run.count;
    state_->progress.traced += run.run.count;
  }
  return State::Clock::now() - state_->told < State::kTellEvery ? Result<void>()
                                                                : state_->store_progress();
}

Result<void> TraceJournal::sync() { return state_->file.sync(); }

Result<void> TraceJournal::compact(bool in_any_case) {
  std::vector<std::uint64_t> records(state_->used.begin(), state_->used.end());
  if (state_->note_record != 0) records.push_back(state_->note_record);
  std::sort(records.begin(), records.end());
  return state_->file.keep_only(records, in_any_case);
}

std::size_t TraceJournal::runs() const { return state_->places.size(); }
std::uint64_t TraceJournal::bytes() const { return state_->file.bytes(); }
std::uint64_t TraceJournal::damaged() const { return state_->damaged; }
std::uint64_t TraceJournal::cut_bytes() const { return state_->file.cut_bytes(); }

Result<JournalSummary> JournalSummary::of(const std::string& path) {
  JournalFile file;
  if (const auto opened = file.open_to_read(path); !opened.ok()) return opened.error();
  JournalSummary summary;
  // The lock comes first: a process that ends meanwhile has then written its last note already.
  summary.is_being_written = file.is_being_written();
  summary.bytes = file.for_each([&](std::uint64_t offset) {
    if (file.count_at(offset) != 0) return;
    const auto record = file.read(offset);
    const auto text = record ? text_of(*record) : std::nullopt;
    if (!text) return;
    if (const auto progress = ShardProgress::from(*text))
      summary.progress = progress;
    else
      summary.note = ShardNote::from(*text);
  });
  summary.cut_bytes = file.bytes() - summary.bytes;
  return summary;
}

namespace {

// Calls use(count, bytes) for each record as it is in the file, and checks all of them.
template <class Use>
Result<void> for_each_record(const std::string& path, const Use& use) {
  JournalFile file;
  if (const auto opened = file.open_to_read(path); !opened.ok()) return opened;
  Result<void> done;
  const std::uint64_t end = file.for_each([&](std::uint64_t offset) {
    if (!done.ok()) return;
    if (const auto record = file.stored(offset))
      done = use(file.count_at(offset), *record);
    else
      done = Error(path + ": the record at byte " + std::to_string(offset) +
                   " fails its checksum; run the shard's command again, which mends it");
  });
  if (done.ok() && end != file.bytes())
    return Error(path + ": is cut short after " + std::to_string(end) + " of " +
                 std::to_string(file.bytes()) +
                 " bytes; run the shard's command again, which mends it");
  return done;
}

}  // namespace

Result<void> check_records(const std::string& path) {
  return for_each_record(path,
                         [](std::uint32_t, std::span<const std::byte>) { return Result<void>(); });
}

Result<void> join_journals(const std::vector<std::string>& paths, const std::string& output,
                           const std::string& note) {
  auto joined = AtomicFile::create(output);
  if (!joined.ok()) return joined.error();
  if (auto written = joined->write(JournalFile::beginning()); !written.ok()) return written;
  for (const std::string& path : paths) {
    auto copied =
        for_each_record(path, [&](std::uint32_t count, std::span<const std::byte> record) {
          return count > 0 ? joined->write(record) : Result<void>();
        });
    if (!copied.ok()) return copied;
  }
  if (auto written = joined->write(JournalFile::record_of(0, std::as_bytes(std::span(note))));
      !written.ok())
    return written;
  return joined->commit();
}

}  // namespace clamor
