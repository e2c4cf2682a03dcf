// level_folder.h: the only way by which a level reads files, confined to its own folder.
//
// A level from elsewhere must not be able to name /etc/passwd as its sound. A URI is a relative
// path, percent-escapes decoded, without a scheme, a leading slash, "..", backslashes or control
// characters; and what it names must, with all symbolic links followed, be a regular file inside
// the level's folder. Every byte read is hashed, in the order of reading.
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

// A whole regular file, from wherever the user says.
Result<FileBytes> read_whole_file(const std::string& path);

// The path inside a folder that a URI of a file there names, or why it may not.
Result<std::string> confined_path(const std::string& folder, std::string_view uri);

// The contents of "data:...;base64,..." in proportion to its length.
Result<FileBytes> decode_data_uri(std::string_view uri);

// xxHash3 over what it is given, lengths included.
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
  // The folder that holds `level_path`.
  explicit LevelFolder(const std::string& level_path);

  // The file that a URI of the level names, or the data that is in the URI itself.
  Result<FileBytes> read(std::string_view uri);

  // A file that the user named: the level, its sidecar, a sound of the command line.
  Result<FileBytes> read_anywhere(const std::string& path);

  const std::string& path() const { return path_; }
  InputHash& hash() { return hash_; }
  std::uint64_t bytes_read() const { return bytes_read_; }
  const std::vector<InputFile>& inputs() const { return inputs_; }  // in the order of reading
  const InputFiles& files() const { return files_; }                // the same, to keep them safe

 private:
  std::string path_;
  InputHash hash_;
  std::uint64_t bytes_read_ = 0;
  std::vector<InputFile> inputs_;
  InputFiles files_;
};

}  // namespace clamor
