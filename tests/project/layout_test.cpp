// layout_test.cpp: the repository keeps its shape: folders, headers of modules, a README that is
// true.

#include <array>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

namespace fs = std::filesystem;

const std::array<std::string, 5> kSourceFolders = {"common", "formats", "bake", "runtime", "tools"};

TEST(Layout, HasTheFoldersOfTheDesignAndNoOthers) {
  const std::set<std::string> expected = {"bake",   "runtime", "common", "formats",
                                          "assets", "tests",   "tools"};
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_directory() && !name.starts_with('.') && name != "build") found.insert(name);
  }
  EXPECT_EQ(found, expected);
}

// The runtime is as large as all others together, so it alone has some, and they have none.
TEST(Layout, HasNoFolderWithinALibraryButTheRuntimes) {
  for (const std::string& folder : kSourceFolders) {
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
      if (entry.is_directory())
        found.insert(entry.path().lexically_relative(kRoot / folder).generic_string());
    if (folder == "runtime")
      EXPECT_EQ(found, std::set(kRuntimeFolders.begin(), kRuntimeFolders.end()));
    else
      EXPECT_TRUE(found.empty()) << folder << " has " << *found.begin();
  }
}

// "// page.h: what for", in the header of a pair, or in the only file of a module.
TEST(Layout, HasAModuleHeaderThatSaysWhatForInEachModule) {
  for (const std::string& folder : kSourceFolders)
    for (const std::string& file : files_in(folder)) {
      if (!file.ends_with(".cpp") && !file.ends_with(".h")) continue;
      const fs::path path = kRoot / file;
      if (file.ends_with(".cpp") && fs::exists(fs::path(path).replace_extension(".h"))) continue;
      const std::string text = read_text(path);
      EXPECT_TRUE(text.starts_with("// " + path.filename().string() + ": "))
          << file << " starts with " << text.substr(0, text.find('\n'));
    }
}

TEST(Layout, HasNoRoomForThingsThatFoundNoPlace) {
  for (const std::string& folder : kSourceFolders)
    for (const std::string& file : files_in(folder)) {
      const std::string name = fs::path(file).stem().string();
      for (const std::string vague :
           {"util", "utils", "helper", "helpers", "core", "manager", "misc"})
        EXPECT_FALSE(name == vague || name.ends_with("_" + vague)) << file;
    }
}

// Where bytes of bakes are made, or what decides them, functions of the C library would make others
// on other CPUs (common/maths.h).
TEST(Layout, TakesNoFunctionThatRoundsByTheCpuWhereBytesAreMade) {
  const std::regex function(
      R"(std::(pow|exp2?|expm1|log(2|10|1p)?|a?(sin|cos|tan)h?|atan2|cbrt|hypot)\()");
  // A listener's way to look, and a level in words.
  const std::set<std::string> others = {"common/listener.h", "formats/audio/audio_file.cpp"};
  for (const std::string folder : {"bake", "common", "formats"})
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file) || others.contains(file)) continue;
      for (const std::string& line : lines_of(read_text(kRoot / file)))
        EXPECT_FALSE(std::regex_search(line, function)) << file << ": " << line;
    }
}

// What works on one machine only. Written in two halves, so that this file is none of it.
TEST(Layout, NamesNoPathOfOneMachine) {
  const std::vector<std::string> places = {
      "/wo"
      "rk/",
      "/ho"
      "me/",
      "/ro"
      "ot/",
      "/Us"
      "ers/",
      "C:\\"
      "Users",
      "\"/t"
      "mp"};
  for (const std::string& file : files_in("")) {
    if (file.ends_with(".glb") || file.ends_with(".flac")) continue;
    const std::string text = read_text(kRoot / file);
    for (const std::string& place : places)
      EXPECT_EQ(text.find(place), std::string::npos) << file << " names " << place;
  }
}

TEST(Layout, HasThePresetsThatTheDesignNames) {
  const auto presets = nlohmann::json::parse(read_text(kRoot / "CMakePresets.json"));
  for (const std::string kind : {"configurePresets", "buildPresets", "testPresets"}) {
    std::set<std::string> names;
    for (const auto& preset : presets.at(kind))
      if (!preset.value("hidden", false)) names.insert(preset.at("name").get<std::string>());
    std::set<std::string> expected{"release", "debug", "asan", "tsan", "clang"};
    if (kind != std::string("testPresets")) expected.insert("fuzz");  // it replays in the others
    EXPECT_EQ(names, expected) << kind;
  }
}

TEST(Readme, LinksToFilesThatExist) {
  static const std::regex kLink(R"re((?:\]\(|href=")([^)"#\s]+))re");
  const std::string readme = read_text(kRoot / "README.md");
  std::size_t links = 0;
  for (auto link = std::sregex_iterator(readme.begin(), readme.end(), kLink);
       link != std::sregex_iterator(); ++link) {
    const std::string target = (*link)[1];
    if (target.starts_with("http")) continue;
    ++links;
    EXPECT_TRUE(fs::exists(kRoot / target)) << target;
  }
  EXPECT_GT(links, 10u);
}

// The lines of the README's code blocks, a line that ends in a backslash joined with the next.
std::vector<std::string> commands_of(const std::string& readme) {
  std::vector<std::string> commands;
  bool inside = false, continued = false;
  for (std::string line : lines_of(readme)) {
    if (line.starts_with("```")) {
      inside = !inside;
      continue;
    }
    if (!inside) continue;
    const bool goes_on = line.ends_with('\\');
    if (goes_on) line.pop_back();
    if (continued)
      commands.back() += line;
    else
      commands.push_back(line);
    continued = goes_on;
  }
  return commands;
}

TEST(Readme, ShowsCommandsAndOptionsThatTheProgramHas) {
  static const std::regex kCommand(R"(^\s*(?:build/release/)?clamor ([a-z]+)(.*))");
  static const std::regex kOption(R"(\s(--?[a-z]+))");
  std::set<std::string> shown;
  for (const std::string& line : commands_of(read_text(kRoot / "README.md"))) {
    std::smatch command;
    if (!std::regex_search(line, command, kCommand)) continue;
    const std::string name = command[1], options = command[2];
    std::string source = read_text(kRoot / "tools/commands" / (name + "_command.cpp"));
    EXPECT_FALSE(source.empty()) << "there is no command " << name;
    if (name == "bake") source += read_text(kRoot / "tools/commands/bake_request.cpp");
    for (const char* const shared : {"mix", "output", "strategy"})
      if (source.find("tools/commands/" + std::string(shared) + "_options.h") != std::string::npos)
        source += read_text(kRoot / "tools/commands" / (std::string(shared) + "_options.cpp"));
    shown.insert(name);
    for (auto option = std::sregex_iterator(options.begin(), options.end(), kOption);
         option != std::sregex_iterator(); ++option) {
      const std::string word = (*option)[1];
      EXPECT_TRUE(source.find('"' + word + '"') != std::string::npos ||
                  source.find('"' + word + ',') != std::string::npos ||
                  source.find(',' + word + '"') != std::string::npos)
          << "clamor " << name << " has no " << word;
    }
  }
  EXPECT_EQ(shown, (std::set<std::string>{"bake", "merge", "compare", "diff", "inspect", "render",
                                          "impulse", "play", "materials", "devices", "experiment",
                                          "bench"}));
}

TEST(Readme, ShowsASidecarWithPresetsThatExist) {
  const std::string readme = read_text(kRoot / "README.md");
  const std::size_t begin = readme.find("```json\n"), end = readme.find("```\n", begin + 8);
  ASSERT_NE(end, std::string::npos);
  const auto sidecar = nlohmann::json::parse(readme.substr(begin + 8, end - begin - 8));
  const auto schema = nlohmann::json::parse(read_text(kRoot / "formats/acoustics.schema.json"));
  const auto presets = nlohmann::json::parse(read_text(kRoot / "assets/materials.json"));
  for (const auto& [key, value] : sidecar.items())
    EXPECT_TRUE(schema["properties"].contains(key)) << key;
  for (const auto& [pattern, material] : sidecar.at("materials").items()) {
    const auto preset =
        material.is_string() ? material : material.value("preset", nlohmann::json());
    if (preset.is_string()) {
      EXPECT_TRUE(presets["materials"].contains(preset.get<std::string>())) << preset;
    }
  }
}

TEST(Readme, ShowsScriptsThatExistWithOptionsTheyTake) {
  static const std::regex kScript(R"(^\s*(tools/[a-z]+)(.*))");
  static const std::regex kOption(R"(\s(--[a-z]+))");
  std::set<std::string> shown;
  for (const std::string& line : commands_of(read_text(kRoot / "README.md"))) {
    std::smatch script;
    if (!std::regex_search(line, script, kScript)) continue;
    const std::string text = read_text(kRoot / script[1].str()), options = script[2];
    EXPECT_FALSE(text.empty()) << script[1];
    EXPECT_NE(fs::status(kRoot / script[1].str()).permissions() & fs::perms::owner_exec,
              fs::perms::none);
    shown.insert(script[1]);
    for (auto option = std::sregex_iterator(options.begin(), options.end(), kOption);
         option != std::sregex_iterator(); ++option)
      EXPECT_NE(text.find((*option)[1].str() + ")"), std::string::npos)
          << script[1] << " takes no " << (*option)[1];
  }
  EXPECT_EQ(shown, (std::set<std::string>{"tools/demo", "tools/test"}));
}

TEST(ContinuousIntegration, RunsWhatDevelopersRun) {
  const std::string script = read_text(kRoot / ".ci/run");
  EXPECT_NE(script.find("tools/test\""), std::string::npos) << script;
}

}  // namespace
}  // namespace clamor::testing
