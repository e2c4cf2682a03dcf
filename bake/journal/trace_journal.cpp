#include "bake/journal/trace_journal.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bake/journal/journal_file.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMaxNoteBytes = 1 << 20;

// Header of a run in a record. The headers of all runs come first, then their deposits.
struct StoredRun {
  std::uint64_t key = 0;
  std::uint32_t photons = 0, deposits = 0;
  TraceTally tally;
};
static_assert(std::is_trivially_copyable_v<StoredRun>);

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

// The run headers of a record, or nothing if its count exceeds its size.
std::optional<std::vector<StoredRun>> runs_of(const JournalFile::Record& record) {
  if (record.count > record.bytes.size() / sizeof(StoredRun)) return std::nullopt;
  std::vector<StoredRun> runs(record.count);
  if (!runs.empty()) std::memcpy(runs.data(), record.bytes.data(), runs.size() * sizeof(StoredRun));
  return runs;
}

}  // namespace

struct TraceJournal::State {
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

  // Collects the keys of all records and truncates an incomplete last one.
  Result<void> index() {
    std::uint64_t offset = JournalFile::first();
    while (const auto end = file.after(offset)) {
      const auto record = file.read(offset);
      const auto runs = record ? runs_of(*record) : std::nullopt;
      if (!runs) {
        ++damaged;
      } else if (runs->empty() && record->bytes.size() <= kMaxNoteBytes) {
        note.assign(reinterpret_cast<const char*>(record->bytes.data()), record->bytes.size());
        note_record = offset;
      }
      for (std::uint32_t i = 0; runs && i < runs->size(); ++i) places[(*runs)[i].key] = {offset, i};
      offset = *end;
    }
    return file.truncate_at(offset);
  }
};

TraceJournal::TraceJournal(std::unique_ptr<State> state) : state_(std::move(state)) {}
TraceJournal::TraceJournal(TraceJournal&&) noexcept = default;
TraceJournal& TraceJournal::operator=(TraceJournal&&) noexcept = default;
TraceJournal::~TraceJournal() = default;

Result<TraceJournal> TraceJournal::open(const std::string& path, std::size_t materials,
                                        std::size_t portals) {
  auto state = std::make_unique<State>();
  state->materials = materials;
  state->portals = portals;
  if (const auto opened = state->file.open(path); !opened.ok()) return opened.error();
  if (const auto indexed = state->index(); !indexed.ok()) return indexed.error();
  return TraceJournal(std::move(state));
}

Result<TraceJournal> TraceJournal::open_to_read(const std::string& path, std::size_t materials,
                                                std::size_t portals) {
  auto state = std::make_unique<State>();
  state->materials = materials;
  state->portals = portals;
  if (const auto opened = state->file.open_to_read(path); !opened.ok()) return opened.error();
  if (const auto indexed = state->index(); !indexed.ok()) return indexed.error();
  return TraceJournal(std::move(state));
}

const std::string& TraceJournal::note() const { return state_->note; }

Result<void> TraceJournal::set_note(const std::string& note) {
  assert(note.size() <= kMaxNoteBytes);
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
  std::uint64_t first = 0, all = 0;
  for (std::uint32_t i = 0; i < runs->size(); ++i) {
    if (i == index) first = all;
    all += (*runs)[i].deposits;
  }
  const std::size_t start = runs->size() * sizeof(StoredRun);
  if (stored.key != key || stored.photons != run.count ||
      start + all * sizeof(Deposit) != record->bytes.size())
    return give_up();

  std::vector<Deposit> deposits(stored.deposits);
  if (!deposits.empty())
    std::memcpy(deposits.data(), record->bytes.data() + start + first * sizeof(Deposit),
                deposits.size() * sizeof(Deposit));
  for (Deposit& deposit : deposits) {
    if (!is_valid(deposit, state_->materials, state_->portals, run.count)) return give_up();
    deposit.emitter = run.emitter;  // indices change when emitters are added or removed
  }
  result.append(run, stored.tally, deposits);
  state_->used.insert(offset);
  return true;
}

Result<void> TraceJournal::append(std::span<const std::uint64_t> keys, const TracedRuns& traced) {
  std::vector<std::byte> payload(traced.runs().size() * sizeof(StoredRun) +
                                 traced.deposits().size() * sizeof(Deposit));
  std::byte* at = payload.data();
  for (std::size_t i = 0; i < traced.runs().size(); ++i) {
    const TracedRun& run = traced.runs()[i];
    StoredRun stored{keys[i], run.run.count, static_cast<std::uint32_t>(run.deposits), run.tally};
    std::memcpy(at, &stored, sizeof stored);
    at += sizeof stored;
  }
  for (const TracedRun& run : traced.runs()) {
    const auto deposits = traced.deposits_of(run);
    if (!deposits.empty()) std::memcpy(at, deposits.data(), deposits.size_bytes());
    at += deposits.size_bytes();
  }

  const auto runs = static_cast<std::uint32_t>(traced.runs().size());
  const auto record = state_->file.append(runs, payload);
  if (!record.ok()) return record.error();
  for (std::uint32_t i = 0; i < runs; ++i) state_->places[keys[i]] = {*record, i};
  state_->used.insert(*record);
  return {};
}

Result<void> TraceJournal::sync() { return state_->file.sync(); }

Result<void> TraceJournal::compact() {
  std::vector<std::uint64_t> records(state_->used.begin(), state_->used.end());
  if (state_->note_record != 0) records.push_back(state_->note_record);
  std::sort(records.begin(), records.end());
  return state_->file.keep_only(records);
}

std::size_t TraceJournal::runs() const { return state_->places.size(); }
std::uint64_t TraceJournal::bytes() const { return state_->file.bytes(); }
std::uint64_t TraceJournal::damaged() const { return state_->damaged; }

}  // namespace clamor
