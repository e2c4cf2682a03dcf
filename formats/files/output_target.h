// output_target.h: resolves and validates the destination of an output before it is computed.
//
// Symbolic links are followed and kept. The destination is either a file, which may not exist yet,
// or a stream, which is written front to back and cannot be replaced: a device such as /dev/null, a
// named pipe, or an open descriptor such as /dev/stdout. Folders, sockets, block devices and
// terminals are refused.
//
// No output may replace a file that the same command reads. Links and mounts give one file many
// paths, so files are compared by device and inode.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/platform/system_file.h"
#include "common/result.h"

namespace clamor {

// The files that a command reads.
class InputFiles {
 public:
  // Ignores empty paths and paths that name no regular file.
  void add(const std::string& path);
  void add(const InputFiles& more);

  std::vector<std::string> paths() const;

  // The path under which the file at `path` was added, if any.
  std::optional<std::string> same_as(const std::string& path) const;

 private:
  struct File {
    FileVersion version;
    std::string path;
  };
  std::vector<File> files_;
};

class OutputTarget {
 public:
  // An Error if nothing can be written there or if the path is one of the inputs.
  static Result<OutputTarget> find(const std::string& path, const InputFiles& inputs = {});

  bool is_stream() const { return is_stream_; }
  bool is_stdout() const;

  // Path of the file with all links resolved.
  const std::string& file() const { return file_; }

  // Path prefix for temporary files: in the folder of the file or, for a stream, in the system's
  // folder for temporary files.
  std::string temporary_prefix() const;

  // Opening a pipe blocks until it has a reader.
  Result<SystemFile> open_stream() const;

 private:
  std::string path_, file_;
  bool is_stream_ = false;
  int descriptor_ = -1;  // -1 unless the path names a descriptor of this process
};

}  // namespace clamor
