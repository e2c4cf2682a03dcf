#include "runtime/engine/auralizer_input.h"

#include <algorithm>
#include <string>
#include <utility>

#include "common/shared_while_used.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/expanded_sources.h"
#include "runtime/occlusion/level_surfaces.h"
#include "runtime/probes/probe_sources.h"

namespace clamor {

Result<AuralizerInput> read_tables(const BakeFile& file) {
  AuralizerInput input;
  input.origin_m = file.origin_m();
  input.emitters = file.source_emitters();
  input.portals = file.portals();
  input.first_portal_emitter = file.emitters().size();
  input.materials = file.materials();
  if (!file.probes().places.empty()) input.materials.push_back(late_reflection_material());
  input.images = image_sources(file.images(), file.emitters());
  input.air = file.settings().air;
  input.decay = file.statistics().decay;
  for (std::size_t i = 0; i < file.signal_count(); ++i) {
    auto envelope = file.read_envelope(i);
    if (!envelope.ok()) return envelope.error();
    const SignalInfo signal = file.signal(i);
    input.envelopes.push_back({std::move(*envelope), signal.frames, signal.loop});
  }
  return input;
}

Result<void> read_occluders(const BakeFile& file, AuralizerInput& input) {
  Result<void> read;
  input.surfaces = file.surfaces().get<LevelSurfaces>([&]() -> std::shared_ptr<LevelSurfaces> {
    auto mesh = file.read_mesh();
    if (mesh.ok())
      return std::make_shared<LevelSurfaces>(std::move(*mesh),
                                             image_sources(file.images(), file.emitters()));
    read = mesh.error();
    return nullptr;
  });
  input.movable_parts = file.movable_parts();
  return read;
}

const Mesh& mesh_of(const AuralizerInput& input) {
  return input.surfaces != nullptr ? input.surfaces->mesh() : input.mesh;
}

Result<AuralizerInput> read_signals_and_tables(const BakeFile& file) {
  auto input = read_tables(file);
  for (std::size_t i = 0; i < file.signal_count() && input.ok(); ++i) {
    auto signal = file.read_signal(i);
    if (!signal.ok()) return signal.error();
    input->signals.push_back(std::move(*signal));
  }
  return input;
}

Result<AuralizerInput> read_auralizer_input(const BakeFile& file) {
  auto all = read_expanded_sources(file);
  if (!all.ok()) return all.error();
  auto input = read_signals_and_tables(file);
  if (!input.ok()) return input;
  input->sources = std::move(all->sources);
  input->images.clear();
  input->emitters = std::move(all->emitters);
  return input;
}

namespace {

std::size_t signal_count(const AuralizerInput& input) {
  return std::max(input.signals.size(), input.envelopes.size());
}

bool is_loop(const AuralizerInput& input, std::size_t signal) {
  return input.envelopes.empty() ? input.signals[signal].loop : input.envelopes[signal].loop;
}

Result<Signal> onset_of(const AuralizerInput& input, std::size_t signal, const BakeFile* file) {
  // The file's signals come first; the input has the others.
  const std::size_t of_file = signal_count(input) - input.signals.size();
  std::vector<float> once;
  if (signal >= of_file) {
    once = input.signals[signal - of_file].samples;
  } else {
    auto block = file->read_signal_block(signal, 0);
    if (!block.ok()) return block.error();
    once = std::move(*block);
  }
  return clamor::onset_of(once);
}

Result<void> add_onsets(const MovingOptions& moving, AuralizerInput& input, const BakeFile* file) {
  for (const MovingKind& kind : moving.kinds) {
    if (!is_loop(input, kind.signal)) continue;
    const auto& loops = input.loop_of_onset;
    if (std::find(loops.begin(), loops.end(), kind.signal) != loops.end()) continue;
    auto onset = onset_of(input, kind.signal, file);
    if (!onset.ok()) return onset.error();
    input.onsets.push_back(std::move(*onset));
    input.loop_of_onset.push_back(kind.signal);
  }
  return {};
}

}  // namespace

std::size_t kinds_of(const MovingOptions& moving) {
  return moving.kinds.size() + (moving.signal_slots > 0 ? moving.max_sources : 0);
}

Signal onset_of(std::span<const float> once) {
  Signal onset{"", {}, false};
  for (int f = 0; f < kOnset_frames && !once.empty(); ++f)
    onset.samples.push_back(once[static_cast<std::size_t>(f) % once.size()]);
  return onset;
}

OnsetSignals onset_signals(const AuralizerInput& input, std::size_t slots) {
  OnsetSignals onsets(signal_count(input), kNoOnset);
  for (std::uint32_t s = 0; s < onsets.size(); ++s)
    if (!is_loop(input, s)) onsets[s] = s;
  for (std::size_t i = 0; i < input.onsets.size(); ++i)
    onsets[input.loop_of_onset[i]] = static_cast<std::uint32_t>(onsets.size() + i);
  if (slots == 0) return onsets;
  onsets.resize(onsets.size() + input.onsets.size(), kNoOnset);
  for (std::size_t i = 0; i < 2 * slots; ++i)
    onsets.push_back(static_cast<std::uint32_t>(onsets.size()));
  return onsets;
}

Result<void> add_kinds(const MovingOptions& moving, AuralizerInput& input, const BakeFile* file) {
  const std::size_t signals =
      std::max(input.signals.size(), input.envelopes.size()) + moving.signals.size();
  for (const MovingKind& kind : moving.kinds) {
    if (kind.signal >= signals)
      return Error("moving sources of kind " + in_quotes(kind.name) + " play signal " +
                   std::to_string(kind.signal) + ", but there are " + std::to_string(signals) +
                   ", those of the bake first. Bring its signal along or name another.");
    for (const float exponent : kind.directivity)
      if (!(exponent >= 0 && exponent <= 1e4f))
        return Error("moving sources of kind " + in_quotes(kind.name) +
                     " have a directivity that is not between 0 and 10000.");
    Emitter emitter;
    emitter.name = kind.name;
    emitter.directivity = kind.directivity;
    emitter.signal = kind.signal;
    input.emitters.push_back(emitter);
  }
  for (const Signal& signal : moving.signals) {
    if (!input.envelopes.empty() || input.signals.empty())
      input.envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
    input.signals.push_back(signal);
  }
  if (const auto added = add_onsets(moving, input, file); !added.ok()) return added;
  if (moving.signal_slots == 0) return {};
  Emitter of_slot;
  of_slot.signal = static_cast<std::uint32_t>(signal_count(input) + input.onsets.size());
  input.emitters.insert(input.emitters.end(), moving.max_sources, of_slot);
  return {};
}

Result<void> check(const AuralizerInput& input) {
  if (const auto right = check_movable_parts(input.movable_parts, input.materials.size());
      !right.ok())
    return right;
  for (const Emitter& emitter : input.emitters)
    if (emitter.signal >= input.signals.size())
      return Error("emitter " + in_quotes(emitter.name) + " plays signal " +
                   std::to_string(emitter.signal) + ", but there are " +
                   std::to_string(input.signals.size()) + ". Bake again.");
  for (const Source& source : input.sources) {
    if (source.emitter >= input.emitters.size())
      return Error("a source belongs to emitter " + std::to_string(source.emitter) +
                   ", but there are " + std::to_string(input.emitters.size()) + ". Bake again.");
    if (!source.is_emitter && source.material >= input.materials.size())
      return Error("a source is of material " + std::to_string(source.material) +
                   ", but there are " + std::to_string(input.materials.size()) + ". Bake again.");
  }
  return {};
}

}  // namespace clamor
