// bake_file_fuzz.cpp: a bake file, opened and read completely: pages, links, signals, geometry. An
// odd first byte disables checksums (every sum is equal) and corrects magic, version and lengths of
// the preamble, so that later parts are reached; above 127, the file is also played for a moment,
// with a moving source at its first probe that moves to the last one.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/sampling/moving_sources.h"
#include "tests/checksums.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

namespace {

void repair(std::string& bytes) {
  if (bytes.size() < sizeof(Preamble)) return;
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof preamble);
  preamble.magic = kMagic;
  preamble.major = kFormatMajor;
  preamble.file_bytes = bytes.size();
  preamble.root_hash = preamble.preamble_hash = hash_of({});
  if (preamble.root_offset <= bytes.size())
    preamble.root_bytes = (bytes.size() - preamble.root_offset) / 8 * 8;
  std::memcpy(bytes.data(), &preamble, sizeof preamble);
}

void play(BakeFile file) {
  AuralizerOptions options;
  options.voices = 20;
  options.wait_for_pages = true;
  const auto& probes = file.probes().places;
  const Vec3 first_m = probes.empty() ? Vec3(2, 3, 1) : probes.front().position_m;
  const Vec3 last_m = probes.empty() ? Vec3(2, 3, 1) : probes.back().position_m;
  if (file.signal_count() > 0) {
    options.moving.max_sources = 1;
    options.moving.kinds = {{"source", 0, same_in_all_bands(2)}};
  }
  const auto auralizer =
      Auralizer::create(std::make_shared<const BakeFile>(std::move(file)), options);
  if (!auralizer.ok()) return;
  MovingSources* const moving = (*auralizer)->moving();
  MovingSource source;
  source.position_m = first_m;
  const auto handle = moving != nullptr ? moving->add(source) : Error("there are none");
  std::vector<float> block(2 * 960);
  for (int keyframe = 0; (*auralizer)->wants_keyframe(); ++keyframe) {
    // Places that are none are refused.
    if (handle.ok() && keyframe == 2) (void)moving->move(*handle, last_m + Vec3(0.2, 0.1, 0));
    if (handle.ok()) moving->commit();
    (*auralizer)->make_keyframe({{3, 4, 1.5}, 0, 0});
  }
  (*auralizer)->mix(block);
  for (const float sample : block)
    if (!std::isfinite(sample)) std::abort();
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  std::string bytes(fuzz::text_of(data + 1, size - 1));
  testing::checksums_are_off = (data[0] & 1) != 0;
  if (testing::checksums_are_off) repair(bytes);
  auto file = BakeFile::open(fuzz::file_with(bytes, ".clamor"));
  if (!file.ok()) {
    if (file.error().message.empty()) std::abort();
    return 0;
  }
  const auto ignore = [](const PageEntry&, const OctreePage&, std::size_t, std::size_t) {
    return Result<void>();
  };
  (void)file->for_each_page(ignore);
  (void)file->for_each_probe_page(ignore);
  for (std::size_t i = 0; i < file->signal_count(); ++i) {
    (void)file->read_signal(i);
    (void)file->read_envelope(i);
  }
  (void)file->read_mesh();
  if ((data[0] & 128) != 0) play(std::move(*file));
  return 0;
}
