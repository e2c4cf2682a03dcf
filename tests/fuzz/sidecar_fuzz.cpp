// sidecar_fuzz.cpp: LEVEL.acoustics.json and material presets.
#include "formats/level/material_presets.h"
#include "formats/level/sidecar.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto presets =
      MaterialPresets::parse(R"({"materials": {"brick": {"absorption": 0.1, "scattering": 0.1}}})");
  const std::string_view text = fuzz::text_of(data, size);
  if (presets.ok()) {
    const auto sidecar = parse_sidecar(text, *presets);
    if (!sidecar.ok() && sidecar.error().message.empty()) std::abort();
  }
  const auto own = MaterialPresets::parse(text);
  if (!own.ok() && own.error().message.empty()) std::abort();
  return 0;
}
