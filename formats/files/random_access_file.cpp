#include "formats/files/random_access_file.h"

#include <cerrno>
#include <cstring>
#include <exception>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/system_reason.h"
#include "formats/files/retry_on_eintr.h"

namespace clamor {

namespace {

FileVersion version_of(const struct stat& status) {
  return {
      status.st_dev, status.st_ino, static_cast<std::uint64_t>(status.st_size),
      static_cast<std::int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec};
}

}  // namespace

std::optional<FileVersion> file_version(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  return version_of(status);
}

Result<RandomAccessFile> RandomAccessFile::open(const std::string& path, FileAccess access) {
  RandomAccessFile file;
  // O_NONBLOCK, because opening a pipe without a writer would block.
  file.descriptor_ =
      retry_on_eintr([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); });
  if (file.descriptor_ < 0)
    return Error(path + ": cannot read it (" + system_reason(errno) + "); check the path");
  struct stat status {};
  if (::fstat(file.descriptor_, &status) != 0 || !S_ISREG(status.st_mode))
    return Error(path + ": is not a file; name a file that 'clamor bake' wrote");
  file.version_ = version_of(status);
  if (access == FileAccess::kMap) file.map();
  return file;
}

RandomAccessFile::RandomAccessFile(SuppliedBytes bytes) : supplied_(std::move(bytes)) {
  version_.bytes = supplied_.size;
}

void RandomAccessFile::map() {
  if (size() == 0 || size() > std::numeric_limits<std::size_t>::max()) return;
  if (!BusErrorGuard::install()) return;
  // Private, because some network file systems allow no other; no page is ever written and copied.
  void* const mapped = ::mmap(nullptr, size(), PROT_READ, MAP_PRIVATE, descriptor_, 0);
  if (mapped == MAP_FAILED) return;
  mapped_ = static_cast<std::byte*>(mapped);
  // will_need() requests exact ranges. Read-around by the kernel adds 128 kB per range on many
  // machines and 8 MB on some.
  ::madvise(mapped, size(), MADV_RANDOM);
}

// If this fails, the zeros stay and fail every checksum, so the range is read with pread() instead.
void RandomAccessFile::map_again(std::span<std::byte> zeros) const {
  if (::mmap(zeros.data(), zeros.size(), PROT_READ, MAP_PRIVATE | MAP_FIXED, descriptor_,
             zeros.data() - mapped_) != MAP_FAILED)
    ::madvise(zeros.data(), zeros.size(), MADV_RANDOM);
}

Result<void> RandomAccessFile::read(std::uint64_t offset, std::uint64_t bytes,
                                    std::vector<std::byte>& into) const {
  try {
    into.resize(bytes);
  } catch (const std::exception&) {  // out of memory, or larger than a vector can be
    return Error("takes more memory than there is");
  }
  if (descriptor_ < 0) {
    if (offset > size() || bytes > size() - offset) return Error("is shorter than it should be");
    if (bytes == 0) return {};
    return supplied_.read ? supplied_.read(offset, into) : Error("is empty");
  }
  std::uint64_t done = 0;
  while (done < bytes) {
    const auto got = retry_on_eintr([&] {
      return ::pread(descriptor_, into.data() + done, bytes - done,
                     static_cast<off_t>(offset + done));
    });
    if (got < 0) return Error(std::string("cannot be read (") + system_reason(errno) + ")");
    if (got == 0) return Error("is not there any more: the file was cut short while it was open");
    done += static_cast<std::uint64_t>(got);
  }
  return {};
}

void RandomAccessFile::will_need(std::uint64_t offset, std::uint64_t bytes) const {
  if (!holds(offset, bytes) || descriptor_ < 0) return;
  if (!is_mapped()) {
    ::posix_fadvise(descriptor_, static_cast<off_t>(offset), static_cast<off_t>(bytes),
                    POSIX_FADV_WILLNEED);
    return;
  }
  const std::span<std::byte> pages = whole_pages({mapped_ + offset, bytes});
  ::madvise(pages.data(), pages.size(), MADV_WILLNEED);
}

RandomAccessFile::RandomAccessFile(RandomAccessFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      version_(std::exchange(other.version_, {})),
      mapped_(std::exchange(other.mapped_, nullptr)),
      supplied_(std::exchange(other.supplied_, {})) {}

RandomAccessFile& RandomAccessFile::operator=(RandomAccessFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(version_, other.version_);
  std::swap(mapped_, other.mapped_);
  std::swap(supplied_, other.supplied_);
  return *this;
}

RandomAccessFile::~RandomAccessFile() {
  if (mapped_ != nullptr) ::munmap(mapped_, size());
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace clamor
