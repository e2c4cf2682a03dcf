#include "runtime/auralizer_input.h"

#include <utility>

#include "runtime/auralizer.h"

namespace clamor {

Result<AuralizerInput> read_auralizer_input(const BakeFile& file) {
  AuralizerInput input;
  auto sources = file.read_all_sources();
  if (!sources.ok()) return sources.error();
  input.sources = std::move(*sources);
  input.emitters = file.emitters();
  input.materials = file.materials();
  input.air = file.settings().air;
  for (std::size_t i = 0; i < file.signal_count(); ++i) {
    auto signal = file.read_signal(i);
    if (!signal.ok()) return signal.error();
    input.signals.push_back(std::move(*signal));
  }
  return input;
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(const BakeFile& file,
                                                     const AuralizerOptions& options) {
  auto input = read_auralizer_input(file);
  if (!input.ok()) return input.error();
  auto auralizer = create(std::move(*input), options);
  if (!auralizer.ok()) return auralizer.error().in(file.path());
  return auralizer;
}

}  // namespace clamor
