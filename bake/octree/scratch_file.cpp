#include "bake/octree/scratch_file.h"

#include <cerrno>

#include "common/system_reason.h"

namespace clamor {

Error ScratchFile::failed(const char* doing) const {
  const int code = errno;
  return Error(beside_ + ": cannot " + doing + " the temporary file for sources that exceed the " +
               "memory (" + system_reason(code) + "); " +
               (is_disk_full(code) ? "free some space, choose another disk or allow more memory"
                                   : "choose a place you may write to or allow more memory"));
}

Result<std::span<std::byte>> ScratchFile::map(std::uint64_t bytes) {
  if (bytes == 0) return std::span<std::byte>();
  if (!file_.is_open()) file_ = SystemFile::unnamed(beside_ + ".sources-XXXXXX");
  if (!file_.is_open()) return failed("make");
  // A full disk has to be an error now, not a signal later.
  if (!file_.allocate(bytes)) return failed("write");
  mapped_ = file_.map_to_write(bytes);
  if (mapped_ == nullptr) return failed("map");
  return std::span(mapped_.get(), bytes);
}

}  // namespace clamor
