#include "bake/trace_journal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/atomic_file.h"
#include "formats/bake_layout.h"
#include "formats/unless_interrupted.h"

namespace clamor {

namespace {

// Goes up whenever the tracer's results change, so that older journals no longer match.
constexpr std::uint64_t kTraceVersion = 1;

constexpr std::array<char, 8> kJournalMagic = {'C', 'L', 'A', 'M', 'O', 'R', 'T', 'J'};
constexpr std::uint32_t kJournalVersion = 1;
constexpr std::uint32_t kRecordMagic = 0x6e757254;  // "Trun"
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 30;
constexpr std::uint64_t kMostNoteBytes = 1 << 20;
// Each sync takes 0.4 to 20 ms, by the disk, and there are 40 batches a second: this costs 2 % at
// most where a sync of every batch costs 5 % to two thirds.
constexpr auto kSyncEvery = std::chrono::seconds(1);
constexpr std::uint64_t kMostRatio = 4000;  // of a zstd frame we would have written

struct FileHeader {
  std::array<char, 8> magic = kJournalMagic;
  std::uint32_t version = kJournalVersion, unused = 0;
};
static_assert(sizeof(FileHeader) == 16);

struct RecordHeader {
  std::uint32_t magic = kRecordMagic, runs = 0;
  std::uint64_t packed_bytes = 0, unpacked_bytes = 0;
  std::uint64_t frame_hash = 0;
  std::uint64_t header_hash = 0;  // of the 32 bytes before
};
static_assert(sizeof(RecordHeader) == 40);

// A run in a record: its key, counts and tally, then its deposits follow with those of the others.
struct StoredRun {
  std::uint64_t key = 0;
  std::uint32_t photons = 0, deposits = 0;
  TraceTally tally;
};
static_assert(std::is_trivially_copyable_v<StoredRun>);

struct StoredDeposit {
  Vec3f position_m, normal, mirror;
  float delay_s = 0;
  Bands power{};
  float u = 0;
  std::uint16_t material = 0, photon = 0;
  std::int32_t polarity = 1;
};
static_assert(sizeof(StoredDeposit) == 84 && std::is_trivially_copyable_v<StoredDeposit>);

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span(&value, 1));
}

bool is_sound(const StoredDeposit& deposit, std::size_t materials, std::uint32_t photons) {
  bool sound = is_finite(Vec3(deposit.position_m)) && is_finite(Vec3(deposit.normal)) &&
               is_finite(Vec3(deposit.mirror)) && deposit.delay_s >= 0 && deposit.delay_s < 1e6f &&
               deposit.u > 0 && deposit.u <= 1 && deposit.material < materials &&
               deposit.photon < photons && std::abs(deposit.polarity) == 1;
  for (const float power : deposit.power) sound = sound && power >= 0 && power < 1e30f;
  return sound;
}

std::string reason() { return std::strerror(errno); }

class Hasher {
 public:
  template <class T>
  Hasher& add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return add(bytes_of(value));
  }
  Hasher& add(std::span<const std::byte> bytes) {
    const std::array<std::uint64_t, 3> parts = {hash_, bytes.size(), hash_of(bytes)};
    hash_ = hash_of(std::as_bytes(std::span(parts)));
    return *this;
  }
  std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0;
};

}  // namespace

struct TraceJournal::State {
  using Clock = std::chrono::steady_clock;

  struct Place {
    std::uint64_t record = 0;  // offset of its header
    std::uint32_t run = 0;     // index within
  };

  std::string path;
  int descriptor = -1;
  bool only_read = false;
  std::size_t materials = 0;
  std::uint64_t bytes = 0, damaged = 0;
  std::unordered_map<std::uint64_t, Place> places;  // by key
  std::unordered_set<std::uint64_t> used;           // records
  std::string note;
  std::uint64_t note_record = 0;  // where it is; 0: nowhere
  std::uint64_t read_record = 0;  // what `unpacked` holds; 0: nothing
  std::uint32_t read_runs = 0;
  std::vector<std::byte> unpacked;
  std::uint64_t synced_bytes = 0;
  Clock::time_point last_sync = Clock::now();

  ~State() {
    if (descriptor < 0) return;
    if (!only_read && synced_bytes != bytes) sync();
    ::close(descriptor);
  }

  bool read_at(std::uint64_t offset, std::span<std::byte> out) const {
    std::size_t done = 0;
    while (done < out.size()) {
      const ssize_t got = unless_interrupted([&] {
        return ::pread(descriptor, out.data() + done, out.size() - done,
                       static_cast<off_t>(offset + done));
      });
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

  bool write_at(std::uint64_t offset, std::span<const std::byte> data) const {
    std::size_t done = 0;
    while (done < data.size()) {
      const ssize_t put = unless_interrupted([&] {
        return ::pwrite(descriptor, data.data() + done, data.size() - done,
                        static_cast<off_t>(offset + done));
      });
      if (put == 0) errno = ENOSPC;  // no room for a byte, and the file system does not say so
      if (put <= 0) return false;
      done += static_cast<std::size_t>(put);
    }
    return true;
  }

  // From here on what is written survives a power cut.
  bool sync() {
    if (unless_interrupted([&] { return ::fdatasync(descriptor); }) != 0) return false;
    synced_bytes = bytes;
    last_sync = Clock::now();
    return true;
  }

  // Right after a write or sync that failed.
  Error unwritten() const {
    return Error(path + ": the journal cannot be written (" + reason() +
                 "); what was traced before is kept. Free some space and run the same command "
                 "again, or use --no-journal");
  }

  bool sync_now_and_then() { return Clock::now() - last_sync < kSyncEvery || sync(); }

  bool cut(std::uint64_t length) const {
    return unless_interrupted(
               [&] { return ::ftruncate(descriptor, static_cast<off_t>(length)); }) == 0;
  }

  bool read_header(std::uint64_t offset, RecordHeader& header) const {
    std::array<std::byte, sizeof(RecordHeader)> raw;
    if (offset + raw.size() > bytes || !read_at(offset, raw)) return false;
    std::memcpy(&header, raw.data(), raw.size());
    return header.magic == kRecordMagic &&
           header.header_hash == hash_of(std::span(raw).first(raw.size() - 8)) &&
           header.packed_bytes <= bytes - offset - raw.size() &&
           header.unpacked_bytes <= kMostRecordBytes &&
           header.unpacked_bytes <= kMostRatio * header.packed_bytes &&
           header.runs * sizeof(StoredRun) <= header.unpacked_bytes;
  }

  // Unpacks a record, if it is not the one at hand. False if it is damaged.
  bool load(std::uint64_t offset) {
    if (offset == read_record) return true;
    read_record = 0;
    RecordHeader header;
    if (!read_header(offset, header)) return false;
    std::vector<std::byte> frame(header.packed_bytes);
    if (!read_at(offset + sizeof header, frame) || hash_of(frame) != header.frame_hash)
      return false;
    auto whole = clamor::unpacked(frame, header.unpacked_bytes);
    if (!whole.ok()) return false;
    unpacked = std::move(*whole);
    read_runs = header.runs;
    read_record = offset;
    return true;
  }

  StoredRun stored_run(std::uint32_t index) const {
    StoredRun run;
    std::memcpy(&run, unpacked.data() + index * sizeof run, sizeof run);
    return run;
  }

  // Reads the keys of all records; cuts off what a crash left incomplete.
  Result<void> index() {
    std::uint64_t offset = sizeof(FileHeader);
    RecordHeader header;
    while (read_header(offset, header)) {
      if (header.runs == 0) {
        if (header.unpacked_bytes <= kMostNoteBytes && load(offset)) {
          note.assign(reinterpret_cast<const char*>(unpacked.data()), unpacked.size());
          note_record = offset;
        }
      } else if (load(offset)) {
        for (std::uint32_t i = 0; i < header.runs; ++i) places[stored_run(i).key] = {offset, i};
      } else {
        ++damaged;
      }
      offset += sizeof header + header.packed_bytes;
    }
    if (only_read) {
      bytes = offset;
      return {};
    }
    if (offset < bytes && !cut(offset))
      return Error(path + ": cannot be cut to its last complete record (" + reason() + ")");
    bytes = offset;
    return {};
  }
};

TraceJournal::TraceJournal(std::unique_ptr<State> state) : state_(std::move(state)) {}
TraceJournal::TraceJournal(TraceJournal&&) noexcept = default;
TraceJournal& TraceJournal::operator=(TraceJournal&&) noexcept = default;
TraceJournal::~TraceJournal() = default;

Result<TraceJournal> TraceJournal::open(const std::string& path, std::size_t materials) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->materials = materials;
  state->descriptor =
      unless_interrupted([&] { return ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644); });
  if (state->descriptor < 0)
    return Error(path + ": the journal cannot be opened (" + reason() +
                 "); make its folder writable, or use --no-journal");
  if (::flock(state->descriptor, LOCK_EX | LOCK_NB) != 0)
    return Error(path +
                 ": another bake is writing this journal; wait for it to end, or choose "
                 "another output");
  struct stat status {};
  if (::fstat(state->descriptor, &status) != 0 || !S_ISREG(status.st_mode))
    return Error(path + ": is not a regular file, so it cannot be a journal");
  state->bytes = static_cast<std::uint64_t>(status.st_size);

  FileHeader header;
  if (state->bytes >= sizeof header) {
    std::array<std::byte, sizeof header> raw;
    if (!state->read_at(0, raw)) return Error(path + ": cannot be read (" + reason() + ")");
    std::memcpy(&header, raw.data(), sizeof header);
    if (header.magic != kJournalMagic)
      return Error(path +
                   ": is no journal of a bake, and is left alone; remove it, or choose "
                   "another output");
  }
  if (state->bytes < sizeof header || header.version != kJournalVersion) {
    header = {};
    if (!state->cut(0) || !state->write_at(0, bytes_of(header)) || !state->sync())
      return Error(path + ": cannot be written (" + reason() +
                   "); free some space, or use "
                   "--no-journal");
    sync_folder_of(path);
    state->bytes = sizeof header;
  }
  if (const auto indexed = state->index(); !indexed.ok()) return indexed.error();
  state->synced_bytes = state->bytes;
  return TraceJournal(std::move(state));
}

Result<TraceJournal> TraceJournal::open_to_read(const std::string& path, std::size_t materials) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->materials = materials;
  state->only_read = true;
  state->descriptor =
      unless_interrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); });
  struct stat status {};
  if (state->descriptor < 0 || ::fstat(state->descriptor, &status) != 0)
    return Error(path + ": cannot be read (" + reason() + ")");
  if (!S_ISREG(status.st_mode)) return Error(path + ": is not a regular file");
  state->bytes = static_cast<std::uint64_t>(status.st_size);
  FileHeader header;
  std::array<std::byte, sizeof header> raw;
  const bool whole = state->bytes >= sizeof header && state->read_at(0, raw);
  if (whole) std::memcpy(&header, raw.data(), sizeof header);
  if (!whole || header.magic != kJournalMagic)
    return Error(path + ": holds no traced photons; shards are made with clamor bake --shard I/N");
  if (header.version != kJournalVersion)
    return Error(path + ": was written by another version of clamor (journal version " +
                 std::to_string(header.version) + ", this one writes " +
                 std::to_string(kJournalVersion) + "); trace it again");
  if (const auto indexed = state->index(); !indexed.ok()) return indexed.error();
  return TraceJournal(std::move(state));
}

const std::string& TraceJournal::note() const { return state_->note; }

Result<void> TraceJournal::set_note(const std::string& note) {
  assert(note.size() <= kMostNoteBytes);
  if (note == state_->note) return {};
  const std::uint64_t record = state_->bytes;
  const auto written = write_record(0, std::as_bytes(std::span(note)));
  if (!written.ok()) return written.error();
  state_->note = note;
  state_->note_record = record;
  return {};
}

bool TraceJournal::find(std::uint64_t key, const PhotonRun& run, TracedRuns& result) {
  const auto found = state_->places.find(key);
  if (found == state_->places.end()) return false;
  const auto [record, index] = found->second;
  const auto give_up = [&] {
    ++state_->damaged;
    state_->places.erase(key);
    return false;
  };
  if (!state_->load(record) || index >= state_->read_runs) return give_up();

  const StoredRun stored = state_->stored_run(index);
  std::uint64_t first = 0, all = 0;
  for (std::uint32_t i = 0; i < state_->read_runs; ++i) {
    if (i == index) first = all;
    all += state_->stored_run(i).deposits;
  }
  const std::size_t start = state_->read_runs * sizeof(StoredRun);
  if (stored.key != key || stored.photons != run.count ||
      start + all * sizeof(StoredDeposit) != state_->unpacked.size())
    return give_up();

  std::vector<Source> deposits;
  std::vector<std::uint16_t> photons;
  deposits.reserve(stored.deposits);
  photons.reserve(stored.deposits);
  const std::byte* at = state_->unpacked.data() + start + first * sizeof(StoredDeposit);
  for (std::uint32_t i = 0; i < stored.deposits; ++i, at += sizeof(StoredDeposit)) {
    StoredDeposit deposit;
    std::memcpy(&deposit, at, sizeof deposit);
    if (!is_sound(deposit, state_->materials, run.count)) return give_up();
    Source& source = deposits.emplace_back();
    source.position_m = deposit.position_m;
    source.normal = deposit.normal;
    source.mirror = deposit.mirror;
    source.delay_s = deposit.delay_s;
    source.power = deposit.power;
    source.u = deposit.u;
    source.emitter = run.emitter;
    source.material = deposit.material;
    source.polarity = static_cast<std::int8_t>(deposit.polarity);
    photons.push_back(deposit.photon);
  }
  result.append(run, stored.tally, deposits, photons);
  state_->used.insert(record);
  return true;
}

Result<void> TraceJournal::append(std::span<const std::uint64_t> keys, const TracedRuns& traced) {
  std::vector<std::byte> payload(traced.runs().size() * sizeof(StoredRun) +
                                 traced.deposits().size() * sizeof(StoredDeposit));
  std::byte* at = payload.data();
  for (std::size_t i = 0; i < traced.runs().size(); ++i) {
    const TracedRun& run = traced.runs()[i];
    StoredRun stored{keys[i], run.run.count, static_cast<std::uint32_t>(run.deposits), run.tally};
    std::memcpy(at, &stored, sizeof stored);
    at += sizeof stored;
  }
  for (const TracedRun& run : traced.runs())
    for (std::size_t i = run.first_deposit; i < run.first_deposit + run.deposits; ++i) {
      const Source& source = traced.deposits()[i];
      const StoredDeposit deposit{source.position_m, source.normal,       source.mirror,
                                  source.delay_s,    source.power,        source.u,
                                  source.material,   traced.photons()[i], source.polarity};
      std::memcpy(at, &deposit, sizeof deposit);
      at += sizeof deposit;
    }

  const std::uint64_t record = state_->bytes;
  const auto runs = static_cast<std::uint32_t>(traced.runs().size());
  if (const auto written = write_record(runs, payload); !written.ok()) return written.error();
  for (std::uint32_t i = 0; i < runs; ++i) state_->places[keys[i]] = {record, i};
  state_->used.insert(record);
  return {};
}

Result<void> TraceJournal::write_record(std::uint32_t runs, std::span<const std::byte> payload) {
  const std::vector<std::byte> frame = packed(payload);
  RecordHeader header;
  header.runs = runs;
  header.packed_bytes = frame.size();
  header.unpacked_bytes = payload.size();
  header.frame_hash = hash_of(frame);
  header.header_hash = hash_of(bytes_of(header).first(sizeof header - 8));
  if (!state_->write_at(state_->bytes, bytes_of(header)) ||
      !state_->write_at(state_->bytes + sizeof header, frame) || !state_->sync_now_and_then()) {
    const Error error = state_->unwritten();
    (void)state_->cut(state_->bytes);  // or the next to open it cuts it
    return error;
  }
  state_->bytes += sizeof header + frame.size();
  return {};
}

Result<void> TraceJournal::sync() {
  return state_->sync() ? Result<void>() : Result<void>(state_->unwritten());
}

Result<void> TraceJournal::compact() {
  std::uint64_t kept = sizeof(FileHeader);
  std::vector<std::uint64_t> records(state_->used.begin(), state_->used.end());
  if (state_->note_record != 0) records.push_back(state_->note_record);
  std::sort(records.begin(), records.end());
  RecordHeader header;
  for (const std::uint64_t record : records)
    if (state_->read_header(record, header)) kept += sizeof header + header.packed_bytes;
  if (2 * kept >= state_->bytes) return {};

  auto file = AtomicFile::create(state_->path);
  if (!file.ok()) return file.error();
  const FileHeader file_header;
  if (auto written = file->write(bytes_of(file_header)); !written.ok()) return written.error();
  for (const std::uint64_t record : records) {
    if (!state_->read_header(record, header)) continue;
    std::vector<std::byte> whole(sizeof header + header.packed_bytes);
    if (!state_->read_at(record, whole)) continue;
    if (auto written = file->write(whole); !written.ok()) return written.error();
  }
  if (auto done = file->commit(); !done.ok()) return done.error();
  state_->bytes = kept;
  return {};
}

std::uint64_t TraceJournal::bytes() const { return state_->bytes; }
std::uint64_t TraceJournal::damaged() const { return state_->damaged; }

std::uint64_t scene_hash(const Level& level, const TraceSettings& settings) {
  Hasher hasher;
  hasher.add(kTraceVersion)
      .add(settings.seed)
      .add(settings.roulette_kappa)
      .add(settings.longest_path_s)
      .add(settings.speed_mps)
      .add(settings.air_loss_per_m)
      .add(settings.most_bounces)
      .add(settings.least_power);
  hasher.add(std::as_bytes(std::span(level.mesh.vertices_m)));
  hasher.add(std::as_bytes(std::span(level.mesh.triangles)));
  hasher.add(std::as_bytes(std::span(level.mesh.materials)));
  for (const Material& material : level.materials)
    hasher.add(material.absorption)
        .add(material.scattering)
        .add(material.phong)
        .add(material.transmission);
  return hasher.hash();
}

std::uint64_t run_key(std::uint64_t scene, const Emitter& emitter, std::uint64_t emitter_key,
                      const PhotonRun& run) {
  return Hasher()
      .add(scene)
      .add(emitter_key)
      .add(emitter.position_m)
      .add(emitter.axis)
      .add(emitter.gain)
      .add(emitter.directivity)
      .add(run.first)
      .add(run.count)
      .hash();
}

}  // namespace clamor
