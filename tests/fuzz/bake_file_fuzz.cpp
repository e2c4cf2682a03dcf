// bake_file_fuzz.cpp: a bake file, opened and read whole. A first byte that is odd gets the
// checksums of preamble and root made right, so that what lies behind them is reached.
#include <algorithm>
#include <cstring>
#include <vector>

#include "formats/bake_file.h"
#include "formats/bake_layout.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  std::string bytes(fuzz::text_of(data + 1, size - 1));
  if ((data[0] & 1) != 0 && bytes.size() >= sizeof(Preamble)) {
    Preamble preamble;
    std::memcpy(&preamble, bytes.data(), sizeof preamble);
    preamble.magic = kMagic;
    preamble.major = kFormatMajor;
    preamble.file_bytes = bytes.size();
    if (preamble.root_offset <= bytes.size()) {
      preamble.root_bytes = (bytes.size() - preamble.root_offset) / 8 * 8;
      preamble.root_hash = hash_of(
          std::as_bytes(std::span(bytes)).subspan(preamble.root_offset, preamble.root_bytes));
    }
    preamble.preamble_hash =
        hash_of(std::as_bytes(std::span(&preamble, 1)).first(kHashedPreambleBytes));
    std::memcpy(bytes.data(), &preamble, sizeof preamble);
  }
  const auto file = BakeFile::open(fuzz::file_with(bytes, ".clamor"));
  if (!file.ok()) {
    if (file.error().message.empty()) std::abort();
    return 0;
  }
  (void)file->for_each_page(
      [](const PageEntry&, const OctreePage&, std::size_t, std::size_t) { return Result<void>(); });
  for (std::size_t i = 0; i < file->signal_count(); ++i) {
    (void)file->read_signal(i);
    (void)file->read_envelope(i);
  }
  (void)file->read_mesh();
  return 0;
}
