// level_folder.h: confines the file access of a level to its own folder.
//
// A downloaded level must not be able to name /etc/passwd as its sound. A URI is a percent-encoded
// relative path without scheme, leading slash, "..", backslashes or control characters, and with
// all symbolic links resolved it must name a regular file inside the level's folder. All bytes are
// hashed in the order of reading.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "formats/files/input_file.h"
#include "formats/files/output_target.h"

namespace clamor {

using FileBytes = std::vector<std::byte>;

// Reads a whole regular file from anywhere.
Result<FileBytes> read_whole_file(const std::string& path);

// Resolves the URI of a file inside `folder` to a path, or says why it is not allowed.
Result<std::string> confined_path(const std::string& folder, std::string_view uri);

// Decodes "data:...;base64,...".
Result<FileBytes> decode_data_uri(std::string_view uri);

// xxHash3 of a sequence of byte ranges and their lengths.
class InputHash {
 public:
  InputHash();
  InputHash(InputHash&&) noexcept;
  ~InputHash();
  void add(std::span<const std::byte> bytes);
  void add(std::string_view text) { add(std::as_bytes(std::span(text))); }
  std::uint64_t value() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class LevelFolder {
 public:
  // Confines access to the folder of `level_path`.
  explicit LevelFolder(const std::string& level_path);

  // Reads the file that a URI of the level names, or decodes a data URI.
  Result<FileBytes> read(std::string_view uri);

  // Reads a file that the user named: the level, its sidecar, a sound of the command line.
  Result<FileBytes> read_anywhere(const std::string& path);

  const std::string& path() const { return path_; }
  InputHash& hash() { return hash_; }
  const std::vector<InputFile>& inputs() const { return inputs_; }  // in the order of reading
  const InputFiles& files() const {
    return files_;
  }  // the same files, which outputs must not replace

 private:
  std::string path_;
  InputHash hash_;
  std::vector<InputFile> inputs_;
  InputFiles files_;
};

}  // namespace clamor
