// main.cpp: make_assets, the generator of Clamor's own levels. The same bytes on every run.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "concert_hall.h"
#include "crowd.h"
#include "presentation_room.h"
#include "sound.h"
#include "stadium.h"
#include "stadium_walk.h"
#include "violin.h"

namespace {

using clamor::Error;
using clamor::Result;

constexpr std::string_view kHelp = R"(make_assets [--check] <folder>

Writes stadium.glb, stadium_paper.glb, stadium_walk.json, violin_room.glb, concert_hall.glb and their
sounds into the folder.

  --check   writes nothing; compares the folder with what would be written (levels byte by byte,
            sounds sample by sample) and fails where they differ

example: make_assets assets/levels
)";

Result<void> write_level(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return Error(path + " cannot be written. Is the folder there, the disk full?");
  return {};
}

Result<void> check_level(const std::string& path, const std::string& bytes) {
  std::ifstream file(path, std::ios::binary);
  const std::string found{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (found == bytes) return {};
  const auto [a, b] = std::mismatch(found.begin(), found.end(), bytes.begin(), bytes.end());
  return Error(path + " (" + std::to_string(found.size()) +
               " bytes) is not what the generator makes (" + std::to_string(bytes.size()) +
               " bytes); they part at byte " + std::to_string(a - found.begin()) +
               ". Run make_assets and commit what it writes.");
}

Result<void> check_sound(const std::string& path, const std::vector<std::int16_t>& samples) {
  const auto found = clamor::assets::read_flac(path);
  if (!found.ok()) return found.error();
  if (*found == samples) return {};
  const auto [a, b] = std::mismatch(found->begin(), found->end(), samples.begin(), samples.end());
  return Error(path + " is not what the generator makes; they part at sample " +
               std::to_string(a - found->begin()) + ". Run make_assets and commit what it writes.");
}

Result<void> make(const std::filesystem::path& folder, bool check) {
  const auto paper = clamor::assets::make_paper_sounds();
  const auto crowd = clamor::assets::make_crowd_sounds();
  const auto put_level = [&](const char* name, const std::string& bytes) {
    const std::string path = (folder / name).string();
    return check ? check_level(path, bytes) : write_level(path, bytes);
  };
  const auto put_sound = [&](const std::string& name, const std::vector<std::int16_t>& samples) {
    const std::string path = (folder / "sounds" / (name + ".flac")).string();
    return check ? check_sound(path, samples) : clamor::assets::write_flac(path, samples);
  };
  if (!check) {
    std::error_code failure;
    std::filesystem::create_directories(folder / "sounds", failure);
    if (failure)
      return Error(folder.string() + " cannot be created: " + failure.message() +
                   ". Choose another folder.");
  }
  std::vector<Result<void>> results;
  results.push_back(
      put_level("stadium.glb", clamor::assets::make_stadium(crowd, clamor::assets::kAnyStarts)));
  results.push_back(put_level("stadium_paper.glb",
                              clamor::assets::make_stadium(paper, clamor::assets::kPaperStarts)));
  results.push_back(put_level("stadium_walk.json", clamor::assets::make_stadium_walk()));
  results.push_back(put_level("violin_room.glb", clamor::assets::make_presentation_room()));
  results.push_back(put_level("concert_hall.glb", clamor::assets::make_concert_hall()));
  results.push_back(put_sound("violin", clamor::assets::make_violin_phrase()));
  for (const auto* sounds : {&paper, &crowd})
    for (const auto& sound : *sounds) results.push_back(put_sound(sound.name, sound.samples));
  for (const Result<void>& result : results)
    if (!result.ok()) return result;
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool check = std::erase(arguments, "--check") > 0;
  if (arguments.size() != 1 || arguments[0].starts_with("-")) {
    std::cerr << kHelp;
    return 2;
  }
  const Result<void> result = make(arguments[0], check);
  if (result.ok()) return 0;
  std::cerr << "make_assets: " << result.error().message << '\n';
  return 1;
}
