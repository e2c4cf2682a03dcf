#include "formats/read_file.h"

#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/unless_interrupted.h"

namespace clamor {

Result<ReadFile> ReadFile::open(const std::string& path) {
  ReadFile file;
  // Without O_NONBLOCK, a pipe that nobody writes to would be waited for.
  file.descriptor_ =
      unless_interrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); });
  if (file.descriptor_ < 0)
    return Error(path + ": cannot read it (" + std::strerror(errno) + "); check the path");
  struct stat status {};
  if (::fstat(file.descriptor_, &status) != 0 || !S_ISREG(status.st_mode))
    return Error(path + ": is not a file; name a file that 'clamor bake' wrote");
  file.size_ = static_cast<std::uint64_t>(status.st_size);
  return file;
}

Result<void> ReadFile::read(std::uint64_t offset, std::uint64_t bytes,
                            std::vector<std::byte>& into) const {
  try {
    into.resize(bytes);
  } catch (const std::exception&) {  // no memory, or more than a vector can hold
    return Error("takes more memory than there is");
  }
  std::uint64_t done = 0;
  while (done < bytes) {
    const auto got = unless_interrupted([&] {
      return ::pread(descriptor_, into.data() + done, bytes - done,
                     static_cast<off_t>(offset + done));
    });
    if (got < 0) return Error(std::string("cannot be read (") + std::strerror(errno) + ")");
    if (got == 0) return Error("is not there any more: the file was cut short while it was open");
    done += static_cast<std::uint64_t>(got);
  }
  return {};
}

ReadFile::ReadFile(ReadFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(std::exchange(other.size_, 0)) {}

ReadFile& ReadFile::operator=(ReadFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  return *this;
}

ReadFile::~ReadFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace clamor
