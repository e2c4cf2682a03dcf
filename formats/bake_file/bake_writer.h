// bake_writer.h: writes a bake file. bake_format.md specifies it.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

struct BakeContents;
class SignalCache;

// Writes the file atomically: on failure an older file at `path` is untouched. The bytes are a
// function of `contents` alone, whatever the number of `threads`. Contents that BakeFile::open()
// would reject are an Error by the same checks, and so is a `stop` that is set meanwhile. `signals`
// spares the encoding of sounds that it has.
Result<void> write_bake(const std::string& path, const BakeContents& contents, int threads,
                        const std::atomic<bool>* stop = nullptr, SignalCache* signals = nullptr);

// Returns the bytes instead of writing them. `name` is for messages.
Result<std::vector<std::byte>> bake_bytes(const std::string& name, const BakeContents& contents,
                                          int threads, const std::atomic<bool>* stop = nullptr,
                                          SignalCache* signals = nullptr);

// "zstd 1.5.4" and so on: libraries whose next version may encode the same contents differently.
std::vector<std::string> file_library_versions();

}  // namespace clamor
