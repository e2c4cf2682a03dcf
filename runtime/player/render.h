// render.h: offline rendering as fast as the machine can, with the same steps as the player: the
// same listener movements give the same samples.
//
// Keyframes are made on a separate thread while the caller's thread mixes earlier ones. Each thread
// waits for the other, so nothing is held or late, and the samples equal those of a single thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "common/result.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer.h"

namespace clamor {

// Takes each interleaved block in order; an error ends the render.
using BlockSink = std::function<Result<void>(std::span<const float>)>;

// Renders `frames` frames along the walk. Ends with an error once `stop` is true; pass it in the
// auralizer's options too, so that keyframes in progress end early. The sink runs on the caller's
// thread and must not move sources, because keyframes are one or two ahead of it (use
// AuralizerOptions::script).
Result<void> render(Auralizer& auralizer, const Walk& walk, std::uint64_t frames,
                    const BlockSink& sink, const std::atomic<bool>* stop = nullptr);

}  // namespace clamor
