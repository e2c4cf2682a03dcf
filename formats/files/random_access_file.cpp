#include "formats/files/random_access_file.h"

#include <cerrno>
#include <exception>
#include <limits>
#include <utility>

#include "common/memory_size.h"
#include "common/system_reason.h"

namespace clamor {

Result<RandomAccessFile> RandomAccessFile::open(const std::string& path, FileAccess access) {
  RandomAccessFile file;
  file.file_ = SystemFile(path, SystemFile::Mode::kRead);
  if (!file.file_.is_open())
    return Error(path + ": cannot read it (" + system_reason(errno) + "); check the path");
  const auto status = file.file_.status();
  if (!status || status->type != FileType::kRegular)
    return Error(path + ": is not a file; name a file that 'clamor bake' wrote");
  file.version_ = status->version;
  if (access == FileAccess::kMap && file.size() > 0 &&
      file.size() <= std::numeric_limits<std::size_t>::max() && BusErrorGuard::install())
    file.mapped_ = file.file_.map_to_read(static_cast<std::size_t>(file.size()));
  return file;
}

RandomAccessFile::RandomAccessFile(SuppliedBytes bytes) : supplied_(std::move(bytes)) {
  version_.bytes = supplied_.size;
}

Result<void> RandomAccessFile::read(std::uint64_t offset, std::uint64_t bytes,
                                    std::vector<std::byte>& into) const {
  try {
    into.resize(memory_size(bytes));
  } catch (const std::exception&) {  // out of memory, or larger than a vector can be
    return Error("takes more memory than there is");
  }
  if (!file_.is_open()) {
    if (offset > size() || bytes > size() - offset) return Error("is shorter than it should be");
    if (bytes == 0) return {};
    return supplied_.read ? supplied_.read(offset, into) : Error("is empty");
  }
  const auto got = file_.read_at(offset, into);
  if (!got) return Error(std::string("cannot be read (") + system_reason(errno) + ")");
  if (*got < bytes) return Error("is not there any more: the file was cut short while it was open");
  return {};
}

void RandomAccessFile::will_need(std::uint64_t offset, std::uint64_t bytes) const {
  if (!holds(offset, bytes) || !file_.is_open()) return;
  if (is_mapped())
    SystemFile::will_need(whole_pages({mapped_.get() + offset, static_cast<std::size_t>(bytes)}));
  else
    file_.will_need(offset, bytes);
}

}  // namespace clamor
