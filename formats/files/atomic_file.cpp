#include "formats/files/atomic_file.h"

#include <cerrno>
#include <filesystem>
#include <utility>
#include <vector>

#include "common/name_length.h"
#include "common/platform/process.h"
#include "common/system_reason.h"
#include "common/utf8_path.h"

namespace clamor {

namespace {

Error failed(const std::string& path, const std::string& doing, int code) {
  const char* advice = is_disk_full(code) ? "free some space or choose another disk"
                       : code == EPIPE    ? "what read it has ended"
                                          : "choose a place you may write to";
  return Error(path + ": cannot " + doing + " (" + system_reason(code) + "); " + advice);
}

std::string folder_of(const std::string& path) {
  const auto folder = path_of(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

// Temporaries are named PATH.HOST.PROCESS.tmp. A name in a folder has at most 255 bytes, of which
// these additions may take 80.
std::string prefix_of(const std::string& path) {
  std::string name = path_of(path).filename().string();
  shorten(name, 170);
  return path_of(path).replace_filename(path_of(name)).string() + "." + host_name() + ".";
}

void remove_stale_temporaries(const std::string& path) {
  const std::string prefix = path_of(prefix_of(path)).filename().string();
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path_of(folder_of(path)), ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(".tmp")) continue;
    const std::string process = name.substr(prefix.size(), name.size() - prefix.size() - 4);
    if (process.empty() || process.size() > 9 ||
        process.find_first_not_of("0123456789") != std::string::npos)
      continue;
    if (has_ended(std::stoi(process))) remove_file(entry.path().string());
  }
}

}  // namespace

AtomicFile::AtomicFile(std::string path, OutputTarget target, std::string temporary,
                       SystemFile file)
    : path_(std::move(path)),
      target_(std::move(target)),
      temporary_(std::move(temporary)),
      file_(std::move(file)) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(target_, other.target_);
  std::swap(temporary_, other.temporary_);
  std::swap(file_, other.file_);
  std::swap(has_appeared_, other.has_appeared_);
  return *this;
}

AtomicFile::~AtomicFile() {
  if (!file_.is_open()) return;
  file_.close();
  if (!temporary_.empty()) remove_file(temporary_);
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  auto target = OutputTarget::find(path);
  if (!target.ok()) return target.error();
  if (target->is_stream()) {
    const std::string pattern = target->temporary_prefix() + "-XXXXXX";
    SystemFile file = SystemFile::unnamed(pattern);
    if (!file.is_open()) return failed(pattern, "make a temporary file", errno);
    return AtomicFile(path, std::move(*target), "", std::move(file));
  }
  remove_stale_temporaries(target->file());
  // The name contains the process id, so an existing file is left from a process that ended.
  const std::string temporary = prefix_of(target->file()) + std::to_string(process_id()) + ".tmp";
  remove_file(temporary);
  SystemFile file(temporary, SystemFile::Mode::kCreate);
  if (!file.is_open()) return failed(path, "write here", errno);
  return AtomicFile(path, std::move(*target), temporary, std::move(file));
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  return file_.write(bytes) ? Result<void>() : Result<void>(failed(path_, "write", errno));
}

Result<void> AtomicFile::write_at(std::size_t offset, std::span<const std::byte> bytes) {
  return file_.write_at(offset, bytes) ? Result<void>()
                                       : Result<void>(failed(path_, "write", errno));
}

// Copies the temporary to the stream; later writes go to the stream directly.
Result<void> AtomicFile::copy_to_stream() {
  auto stream = target_.open_stream();
  if (!stream.ok()) return stream.error();
  const SystemFile from = std::exchange(file_, std::move(*stream));
  std::vector<std::byte> part(std::size_t{1} << 16);
  for (std::uint64_t offset = 0;; offset += part.size()) {
    const auto got = from.read_at(offset, part);
    if (!got) return failed(path_, "read the temporary file", errno);
    if (auto copied = write(std::span(part).first(*got)); !copied.ok()) return copied;
    if (*got < part.size()) return {};
  }
}

Result<void> AtomicFile::appear() {
  has_appeared_ = true;
  if (is_stream()) return copy_to_stream();
  if (!replace_file(temporary_, target_.file())) return failed(path_, "write here", errno);
  temporary_.clear();
  sync_folder_of(target_.file());
  return {};
}

Result<void> AtomicFile::commit() {
  if (!is_stream() && !file_.sync()) return failed(path_, "write", errno);
  if (!has_appeared_)
    if (const auto appeared = appear(); !appeared.ok()) return appeared;
  file_.close();
  return {};
}

void sync_folder_of(const std::string& path) { sync_folder(folder_of(path)); }

Result<void> write_file(const std::string& path, std::string_view text) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  if (auto written = file->write(std::as_bytes(std::span(text))); !written.ok()) return written;
  return file->commit();
}

}  // namespace clamor
