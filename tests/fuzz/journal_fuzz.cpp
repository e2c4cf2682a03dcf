// journal_fuzz.cpp: the journal of a bake. Input: four bytes with the number of runs and the
// payload of a record, which gets a valid frame and checksums; after a first byte of 255 the rest
// is the file.
#include <cstring>
#include <vector>

#include "bake/journal/trace_journal.h"
#include "formats/bake_file/bake_layout.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

namespace {

template <class T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 12) return 0;
  std::string bytes;
  std::uint64_t key = 0;
  if (data[0] == 255) {
    bytes = fuzz::text_of(data + 1, size - 1);
  } else {
    std::uint32_t runs = 0;
    std::memcpy(&runs, data, 4);
    std::memcpy(&key, data + 4, 8);
    const auto frame = packed(std::as_bytes(std::span(data + 4, size - 4)));
    bytes = "CLAMORTJ";
    put(bytes, std::uint32_t{3});
    put(bytes, std::uint32_t{0});
    std::string header;
    put(header, std::uint32_t{0x6e757254});
    put(header, runs);
    put(header, std::uint64_t{frame.size()});
    put(header, std::uint64_t{size - 4});
    put(header, hash_of(frame));
    put(header, hash_of(std::as_bytes(std::span(header))));
    bytes += header;
    bytes.append(reinterpret_cast<const char*>(frame.data()), frame.size());
  }
  const std::string path = fuzz::file_with(bytes, ".journal");
  (void)JournalSummary::of(path);
  auto journal = TraceJournal::open_to_read(path, 3);
  if (!journal.ok()) return 0;
  TracedRuns found;
  for (const std::uint32_t photons : {1u, 4u, 1024u})
    if (journal->find(key, {0, 0, photons}, found))
      for (const Deposit& deposit : found.deposits())
        if (!(deposit.random > 0) || deposit.material >= 3 || deposit.emitter != 0) std::abort();
  return 0;
}
