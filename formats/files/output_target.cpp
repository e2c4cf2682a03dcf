#include "formats/files/output_target.h"

#include <cerrno>
#include <charconv>
#include <filesystem>

#include "common/platform/process.h"
#include "common/platform/terminal.h"
#include "common/system_reason.h"
#include "common/utf8_path.h"

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
  const std::string process = "/proc/" + std::to_string(process_id());
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
  fs::path at = path_of(path);
  for (int links = 0; links <= kMaxLinks; ++links) {
    const fs::path parent = at.parent_path().empty() ? "." : at.parent_path();
    std::error_code problem;
    const fs::path folder = fs::canonical(parent, problem);
    if (problem || !fs::is_directory(folder, problem))
      return Error(path + ": the folder " + in_quotes(parent.string()) +
                   " does not exist; make it first");
    const std::string name = at.filename().string();
    if (name.empty() || name == "." || name == "..") return unwritable(path, EISDIR);
    if (own_descriptor(folder, name) || !fs::is_symlink(folder / path_of(name), problem))
      return EndOfLinks{folder, name};
    const fs::path next = fs::read_symlink(folder / path_of(name), problem);
    if (problem) return unwritable(path, problem.value());
    at = next.is_absolute() ? next : folder / next;
  }
  return unwritable(path, ELOOP);
}

}  // namespace

void InputFiles::add(const std::string& path) {
  if (const auto version = file_version(path)) files_.push_back({*version, path});
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
  const auto status = file_status(path);
  if (!status) return std::nullopt;
  for (const File& file : files_)
    if (file.version.is_same_file(status->version)) return file.path;
  return std::nullopt;
}

Result<OutputTarget> OutputTarget::find(const std::string& path, const InputFiles& inputs) {
  if (path.empty()) return Error("the output's name is empty; name a file to write");
  const auto status = file_status(path);
  if (status && status->type == FileType::kFolder)
    return Error(path + ": is a folder; name a file to write");
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
    if (!is_open_to_write(*descriptor)) return unwritable(path, EBADF);
    if (is_terminal(*descriptor))
      return Error(path + ": is a terminal; send it to a file or a pipe");
    target.is_stream_ = true;
    target.descriptor_ = *descriptor;
    return target;
  }
  target.file_ = (end->folder / path_of(end->name)).string();
  if (!status || status->type == FileType::kRegular) {
    if (status && !may_write(path)) return unwritable(path, errno);
    if (!may_write_in_folder(end->folder.string())) return unwritable(path, errno);
    return target;
  }
  if (status->type != FileType::kPipe && status->type != FileType::kCharacterDevice)
    return Error(path + ": is a " + (status->type == FileType::kSocket ? "socket" : "disk") +
                 ", not a file; name a file to write");
  if (!may_write(path)) return unwritable(path, errno);
  target.is_stream_ = true;
  return target;
}

bool OutputTarget::is_stdout() const { return descriptor_ == 1; }

std::string OutputTarget::temporary_prefix() const {
  if (!is_stream_) return file_;
  std::error_code ignored;
  return (fs::temp_directory_path(ignored) / "clamor").string();
}

Result<SystemFile> OutputTarget::open_stream() const {
  SystemFile stream = descriptor_ >= 0 ? SystemFile::duplicate(descriptor_)
                                       : SystemFile(path_, SystemFile::Mode::kStream);
  if (!stream.is_open()) return unwritable(path_, errno);
  return stream;
}

}  // namespace clamor
