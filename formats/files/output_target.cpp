#include "formats/files/output_target.h"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/system_reason.h"
#include "formats/files/retry_on_eintr.h"

namespace clamor {

namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  // the limit of Linux

Error unwritable(const std::string& path, int code) {
  return Error(path + ": cannot write here (" + system_reason(code) +
               "); choose a place you may write to");
}

// The descriptor of this process that a path in /proc names.
std::optional<int> own_descriptor(const fs::path& folder, const std::string& name) {
  const std::string process = "/proc/" + std::to_string(::getpid());
  const std::string where = folder.string();
  if (!where.starts_with(process + "/") || !where.ends_with("/fd")) return std::nullopt;
  int number = 0;
  const char* const end = name.data() + name.size();
  const auto [rest, problem] = std::from_chars(name.data(), end, number);
  if (problem != std::errc() || rest != end) return std::nullopt;
  return number;
}

struct EndOfLinks {
  fs::path folder;
  std::string name;
};

// Follows links to a name that is no link (it need not exist) or that names a descriptor.
Result<EndOfLinks> follow(const std::string& path) {
  fs::path at = path;
  for (int links = 0; links <= kMaxLinks; ++links) {
    const fs::path parent = at.parent_path().empty() ? "." : at.parent_path();
    std::error_code problem;
    const fs::path folder = fs::canonical(parent, problem);
    if (problem || !fs::is_directory(folder, problem))
      return Error(path + ": the folder " + in_quotes(parent.string()) +
                   " does not exist; make it first");
    const std::string name = at.filename().string();
    if (name.empty() || name == "." || name == "..") return unwritable(path, EISDIR);
    if (own_descriptor(folder, name) || !fs::is_symlink(folder / name, problem))
      return EndOfLinks{folder, name};
    const fs::path next = fs::read_symlink(folder / name, problem);
    if (problem) return unwritable(path, problem.value());
    at = next.is_absolute() ? next : folder / next;
  }
  return unwritable(path, ELOOP);
}

}  // namespace

void InputFiles::add(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode))
    files_.push_back({status.st_dev, status.st_ino, path});
}

void InputFiles::add(const InputFiles& more) {
  files_.insert(files_.end(), more.files_.begin(), more.files_.end());
}

std::vector<std::string> InputFiles::paths() const {
  std::vector<std::string> paths;
  for (const File& file : files_) paths.push_back(file.path);
  return paths;
}

std::optional<std::string> InputFiles::same_as(const std::string& path) const {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  for (const File& file : files_)
    if (file.device == status.st_dev && file.inode == status.st_ino) return file.path;
  return std::nullopt;
}

Result<OutputTarget> OutputTarget::find(const std::string& path, const InputFiles& inputs) {
  if (path.empty()) return Error("the output's name is empty; name a file to write");
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) return Error(path + ": is a folder; name a file to write");
  if (const auto input = inputs.same_as(path))
    return Error(path +
                 (*input == path
                      ? ": is read by this command"
                      : ": is the same file as " + *input + ", which this command reads") +
                 ", so it cannot be written; name another output");
  const auto end = follow(path);
  if (!end.ok()) return end.error();

  OutputTarget target;
  target.path_ = path;
  if (const auto descriptor = own_descriptor(end->folder, end->name)) {
    const int flags = ::fcntl(*descriptor, F_GETFL);
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) return unwritable(path, EBADF);
    if (::isatty(*descriptor) != 0)
      return Error(path + ": is a terminal; send it to a file or a pipe");
    target.is_stream_ = true;
    target.descriptor_ = *descriptor;
    return target;
  }
  target.file_ = (end->folder / end->name).string();
  if (!exists || S_ISREG(status.st_mode)) {
    if (exists && ::access(path.c_str(), W_OK) != 0) return unwritable(path, errno);
    if (::access(end->folder.c_str(), W_OK | X_OK) != 0) return unwritable(path, errno);
    return target;
  }
  if (!S_ISFIFO(status.st_mode) && !S_ISCHR(status.st_mode))
    return Error(path + ": is a " + (S_ISSOCK(status.st_mode) ? "socket" : "disk") +
                 ", not a file; name a file to write");
  if (::access(path.c_str(), W_OK) != 0) return unwritable(path, errno);
  target.is_stream_ = true;
  return target;
}

bool OutputTarget::is_stdout() const { return descriptor_ == STDOUT_FILENO; }

std::string OutputTarget::temporary_prefix() const {
  if (!is_stream_) return file_;
  std::error_code ignored;
  return fs::temp_directory_path(ignored) / "clamor";
}

Result<int> OutputTarget::open_stream() const {
  const int opened = retry_on_eintr([&] {
    return descriptor_ >= 0 ? ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0)
                            : ::open(path_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  });
  if (opened < 0) return unwritable(path_, errno);
  return opened;
}

}  // namespace clamor
