// render.h: what a listener hears, computed as fast as the machine can: the player's own step, so
// that the same listeners give the same samples.
//
// Keyframes are made on a thread of their own while the caller's mixes those before. Neither ever
// goes on without the other: the mixer waits for its keyframe, so nothing is held or late, and the
// samples are those of one thread that does both in turn.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "common/result.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer.h"

namespace clamor {

// Takes each block, interleaved, in order; an Error ends the render.
using BlockSink = std::function<Result<void>(std::span<const float>)>;

// Renders `frames` frames of what one hears on the walk. Once `stop` is true, which should be that
// of the auralizer's options too, it ends with an Error, without waiting for keyframes. The sink,
// on the caller's thread, must leave the sources that move alone: they are a keyframe or two ahead
// of it (AuralizerOptions has a script for that).
Result<void> render(Auralizer& auralizer, const Walk& walk, std::uint64_t frames,
                    const BlockSink& sink, const std::atomic<bool>* stop = nullptr);

// Makes as many keyframes as the auralizer wants, each at the walk's listener of its time.
void make_keyframes(Auralizer& auralizer, const Walk& walk);

}  // namespace clamor
