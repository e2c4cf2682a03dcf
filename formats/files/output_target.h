// output_target.h: where an output goes, found out before anything is made.
//
// A path may lead through symbolic links: the output is what stands at their end, and the links
// stay. That is either a file, which may not exist yet, or a stream, which is written front to back
// and cannot be replaced: a device such as /dev/null, a named pipe, or an open descriptor such as
// /dev/stdout. Folders, sockets and disks take no output, nor does a terminal on a descriptor.
//
// No output may replace a file that the same command reads. Paths cannot tell, because links and
// mounts give one file many names, so files are compared by device and inode.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "common/result.h"

namespace clamor {

// The files that a command reads.
class InputFiles {
 public:
  // Paths that are empty or name no regular file are left out: nothing can be lost there.
  void add(const std::string& path);
  void add(const InputFiles& more);

  // The path under which the file at `path` was added, if it was.
  std::optional<std::string> same_as(const std::string& path) const;

 private:
  struct File {
    dev_t device;
    ino_t inode;
    std::string path;
  };
  std::vector<File> files_;
};

class OutputTarget {
 public:
  // An Error where nothing can be written, or where one of the inputs stands.
  static Result<OutputTarget> find(const std::string& path, const InputFiles& inputs = {});

  bool is_stream() const { return is_stream_; }
  bool is_stdout() const;

  // The path of a file with all links resolved.
  const std::string& file() const { return file_; }

  // How the path of a temporary file begins: beside the file, or, for a stream, in the system's
  // folder for temporary files.
  std::string beside() const;

  // Opens a stream; the caller closes the descriptor. Opening a pipe waits for its reader.
  Result<int> open_stream() const;

 private:
  std::string path_, file_;
  bool is_stream_ = false;
  int descriptor_ = -1;  // of this process, where the path leads to one
};

}  // namespace clamor
