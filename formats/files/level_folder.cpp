#include "formats/files/level_folder.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>

#include <xxhash.h>

#include "common/platform/system_file.h"
#include "common/system_reason.h"
#include "common/utf8_path.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMaxFile_bytes = std::uint64_t{16} << 30;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

Result<std::string> percent_decoded(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      out += uri[i];
      continue;
    }
    const int high = i + 2 < uri.size() ? hex_digit(uri[i + 1]) : -1;
    const int low = i + 2 < uri.size() ? hex_digit(uri[i + 2]) : -1;
    if (high < 0 || low < 0)
      return Error("has a % that is no escape; write %25 for a percent sign.");
    out += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return out;
}

bool has_scheme(std::string_view path) {
  const auto colon = path.find(':');
  return colon != std::string_view::npos && path.substr(0, colon).find('/') == path.npos;
}

bool climbs(std::string_view path) {
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    if (path.substr(begin, end - begin) == "..") return true;
    begin = end + 1;
  }
  return false;
}

}  // namespace

Result<FileBytes> read_whole_file(const std::string& path) {
  const auto failed = [&](int error) {
    return Error(path + ": cannot be read: " + system_reason(error) +
                 ". Check the name and that you may read it.");
  };
  const SystemFile file(path, SystemFile::Mode::kRead);
  const auto status = file.is_open() ? file.status() : std::nullopt;
  if (!status) return failed(errno);
  if (status->type != FileType::kRegular) return Error(path + ": is no regular file; name a file.");
  if (status->version.bytes > kMaxFile_bytes)
    return Error(path + ": is larger than 16 GiB, the most that is read; cut it into parts.");

  FileBytes bytes(static_cast<std::size_t>(status->version.bytes));
  const auto got = file.read_at(0, bytes);
  if (!got) return failed(errno);
  bytes.resize(*got);  // the file may have been cut meanwhile
  return bytes;
}

Result<std::string> confined_path(const std::string& folder, std::string_view uri) {
  const auto refused = [&](const std::string& why) {
    return Error("URI " + in_quotes(uri.substr(0, 200)) + " " + why);
  };
  const auto decoded = percent_decoded(uri);
  if (!decoded.ok()) return refused(decoded.error().message);
  const std::string& path = *decoded;
  for (const char c : path)
    if (static_cast<unsigned char>(c) < 0x20 || c == '\\')
      return refused(
          "has a backslash or a control character; use plain names with / between them.");
  if (path.empty()) return refused("is empty; name a file in the folder.");
  if (path.front() == '/' || has_scheme(path) || climbs(path))
    return refused(
        "leads out of the folder of what names it; put the file into that folder and give its "
        "path from there.");

  std::error_code problem;
  std::string root = std::filesystem::canonical(path_of(folder), problem).generic_string();
  if (problem) return refused("has no folder: " + system_reason(problem.value()) + ".");
  if (!root.ends_with('/')) root += '/';
  const std::string resolved =
      std::filesystem::canonical(path_of(root + path), problem).generic_string();
  if (problem)
    return refused("cannot be read: " + system_reason(problem.value()) +
                   ". Put the file into the folder of what names it.");
  if (resolved + "/" == root) return refused("is the folder itself; name a file in it.");
  if (!resolved.starts_with(root))
    return refused(
        "is a link that leads out of the folder of what names it; put the file itself there.");
  return resolved;
}

Result<FileBytes> decode_data_uri(std::string_view uri) {
  const auto comma = uri.find(',');
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64"))
    return Error("a data URI must be 'data:TYPE;base64,...'; export the file again.");
  static const auto kDigits = [] {
    std::array<signed char, 256> digits;
    digits.fill(-1);
    constexpr std::string_view kAlphabet =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < kAlphabet.size(); ++i)
      digits[static_cast<unsigned char>(kAlphabet[i])] = static_cast<signed char>(i);
    return digits;
  }();
  std::string_view text = uri.substr(comma + 1);
  while (text.ends_with('=')) text.remove_suffix(1);
  FileBytes bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int digit = kDigits[static_cast<unsigned char>(c)];
    if (digit < 0)
      return Error("a data URI holds characters that are no base64; export the file again.");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes.push_back(static_cast<std::byte>(bits >> count & 0xff));
    }
  }
  return bytes;
}

struct InputHash::State {
  XXH3_state_t* xxh = XXH3_createState();
  ~State() { XXH3_freeState(xxh); }
};

InputHash::InputHash() : state_(std::make_unique<State>()) { XXH3_64bits_reset(state_->xxh); }
InputHash::InputHash(InputHash&&) noexcept = default;
InputHash::~InputHash() = default;

void InputHash::add(std::span<const std::byte> bytes) {
  const std::uint64_t size = bytes.size();
  XXH3_64bits_update(state_->xxh, &size, sizeof size);
  XXH3_64bits_update(state_->xxh, bytes.data(), bytes.size());
}

std::uint64_t InputHash::value() const { return XXH3_64bits_digest(state_->xxh); }

LevelFolder::LevelFolder(const std::string& level_path)
    : path_(path_of(level_path).parent_path().string()) {
  if (path_.empty()) path_ = ".";
}

Result<FileBytes> LevelFolder::read(std::string_view uri) {
  if (uri.starts_with("data:"))
    return decode_data_uri(uri);  // hashed as part of the file that contains it
  const auto path = confined_path(path_, uri);
  if (!path.ok()) return path.error();
  return read_anywhere(*path);
}

Result<FileBytes> LevelFolder::read_anywhere(const std::string& path) {
  auto bytes = read_whole_file(path);
  if (bytes.ok()) {
    hash_.add(*bytes);
    files_.add(path);
    inputs_.push_back({path_of(path).filename().string(), bytes->size(),
                       XXH3_64bits(bytes->data(), bytes->size())});
  }
  return bytes;
}

}  // namespace clamor
