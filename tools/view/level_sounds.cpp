#include "tools/view/level_sounds.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>

#include "formats/audio/audio_file.h"
#include "formats/files/level_folder.h"

namespace clamor {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSounds = 200, kMaxFiles = 20'000;
constexpr int kMaxDepth = 2;

bool is_sound_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const std::string_view known :
       {".wav", ".flac", ".ogg", ".oga", ".opus", ".mp3", ".aif", ".aiff", ".au", ".caf", ".w64"})
    if (extension == known) return true;
  return false;
}

fs::path folder_of(const std::string& level_path) {
  std::error_code none;
  return fs::weakly_canonical(fs::absolute(level_path, none).parent_path(), none);
}

// A percent sign begins an escape in a URI.
std::string as_uri(const std::string& path) {
  std::string uri;
  for (const char c : path) uri += c == '%' ? std::string("%25") : std::string(1, c);
  return uri;
}

}  // namespace

std::vector<std::string> sounds_beside(const std::string& level_path) {
  const fs::path folder = folder_of(level_path);
  std::vector<std::string> sounds;
  std::error_code failed;
  fs::recursive_directory_iterator files(folder, fs::directory_options::skip_permission_denied,
                                         failed);
  for (std::size_t seen = 0; !failed && files != fs::recursive_directory_iterator();
       files.increment(failed)) {
    if (++seen > kMaxFiles || sounds.size() == kMaxSounds) break;
    if (files.depth() >= kMaxDepth) files.disable_recursion_pending();
    std::error_code unknown;
    if (is_sound_name(files->path()) && files->is_regular_file(unknown))
      sounds.push_back(files->path().lexically_relative(folder).string());
  }
  std::ranges::sort(sounds);
  return sounds;
}

Result<std::string> sound_of_level(const std::string& level_path, const std::string& file) {
  const fs::path folder = folder_of(level_path);
  const std::string quoted = in_quotes(file);
  if (file.empty()) return Error("Name a sound file, as in sounds/violin.flac.");
  std::error_code none;
  fs::path found = folder / file;  // the file itself if it is absolute
  if (!fs::exists(found, none)) found = fs::absolute(file, none);
  if (!fs::exists(found, none))
    return Error(quoted + " is not there. Give its path from the level's folder, " +
                 folder.string() + ".");
  const std::string inside = fs::weakly_canonical(found, none).lexically_relative(folder).string();
  if (inside.empty() || inside.starts_with(".."))
    return Error(quoted + " lies outside the level's folder, so the level would not find it " +
                 "elsewhere. Copy it into " + folder.string() + " and add it from there.");
  const std::string uri = as_uri(inside);
  LevelFolder level(level_path);
  const auto bytes = level.read(uri);
  if (!bytes.ok()) return bytes.error();
  if (const auto samples = decode_audio(*bytes, quoted); !samples.ok()) return samples.error();
  return uri;
}

}  // namespace clamor
