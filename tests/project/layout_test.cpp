// layout_test.cpp: checks the shape of the repository: folders, module headers and pages.

#include <algorithm>
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
                                          "assets", "tests",   "tools",  "findings"};
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_directory() && !name.starts_with('.') && name != "build") found.insert(name);
  }
  EXPECT_EQ(found, expected);
}

TEST(Layout, HasTheFoldersOfTheDesignWithinEachLibraryAndNoneInThose) {
  for (const auto& [library, folders] : kFolders) {
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / library))
      if (entry.is_directory() && entry.path().filename() != "__pycache__")
        found.insert(entry.path().lexically_relative(kRoot / library).generic_string());
    EXPECT_EQ(found, std::set(folders.begin(), folders.end())) << library;
  }
}

// The module header "// page.h: what for" is in the header of a pair, or in a module's only file.
TEST(Layout, HasAModuleHeaderThatSaysWhatForInEachModule) {
  for (const std::string& folder : kSourceFolders)
    for (const std::string& file : files_in(folder)) {
      if (!file.ends_with(".cpp") && !file.ends_with(".h")) continue;
      const fs::path path = kRoot / file;
      if (file.ends_with(".cpp") && fs::exists(fs::path(path).replace_extension(".h"))) continue;
      const std::string text = read_text(path);
      const std::string name = path.filename().string() + ": ";
      EXPECT_TRUE(text.starts_with("// " + name) || text.starts_with("/* " + name))  // C
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

// Functions of the C library round differently on other CPUs (common/maths.h), so code that decides
// the bytes of a bake does not use them.
TEST(Layout, TakesNoFunctionThatRoundsByTheCpuWhereBytesAreMade) {
  const std::regex function(
      R"(std::(pow|exp2?|expm1|log(2|10|1p)?|a?(sin|cos|tan)h?|atan2|cbrt|hypot)\()");
  // These files only orient a listener and print a level.
  const std::set<std::string> others = {"common/listener.h", "formats/audio/audio_file.cpp"};
  for (const std::string folder : {"bake", "common", "formats"})
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file) || others.contains(file)) continue;
      for (const std::string& line : lines_of(read_text(kRoot / file)))
        EXPECT_FALSE(std::regex_search(line, function)) << file << ": " << line;
    }
}

// On Windows, destructors of thread_local objects run when their memory is freed already
// (common/object_pool.h), so none but pointers and flags are thread_local.
TEST(Layout, KeepsNothingWithADestructorForEachThread) {
  const std::regex trivial(R"(thread_local (bool|\w+\*) )");
  for (const std::string folder : {"bake", "common", "formats", "runtime", "tools"})
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file)) continue;
      for (const std::string& line : lines_of(read_text(kRoot / file)))
        EXPECT_TRUE(line.find("thread_local ") == std::string::npos ||
                    std::regex_search(line, trivial))
            << file << ": " << line;
    }
}

// Paths of one machine. Each is written in two halves, so that this file does not match.
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

// Longer lines hide what a change of a page changes. Characters are code points of UTF-8.
TEST(Layout, HasNoLineOfAPageAbove400Characters) {
  std::size_t pages = 0;
  for (const std::string& file : files_in("")) {
    if (!file.ends_with(".md")) continue;
    ++pages;
    std::size_t number = 0;
    for (const std::string& line : lines_of(read_text(kRoot / file))) {
      ++number;
      const auto length = std::count_if(line.begin(), line.end(), [](char byte) {
        return (static_cast<unsigned char>(byte) & 0xc0) != 0x80;
      });
      EXPECT_LE(length, 400) << file << ':' << number << ": " << line.substr(0, 60);
    }
  }
  EXPECT_GT(pages, 15u);
}

TEST(Layout, HasThePresetsThatTheDesignNames) {
  const auto presets = nlohmann::json::parse(read_text(kRoot / "CMakePresets.json"));
  for (const std::string kind : {"configurePresets", "buildPresets", "testPresets"}) {
    std::set<std::string> names;
    for (const auto& preset : presets.at(kind))
      if (!preset.value("hidden", false)) names.insert(preset.at("name").get<std::string>());
    std::set<std::string> expected{"release", "debug", "asan", "tsan", "clang"};
    if (kind != std::string("testPresets")) expected.insert("fuzz");  // it replays in the others
    if (kind == std::string("configurePresets")) expected.insert("wasm");  // by tools/bundle
    EXPECT_EQ(names, expected) << kind;
  }
}

// A finding is a script that can be run as it is, and that README.md has a line for.
TEST(Findings, AreScriptsThatTheirPageNames) {
  const std::string page = read_text(kRoot / "findings/README.md");
  std::size_t scripts = 0;
  for (const std::string& file : files_in("findings")) {
    if (file == "findings/README.md") continue;
    ++scripts;
    const std::string name = fs::path(file).filename().string(), text = read_text(kRoot / file);
    EXPECT_TRUE(file == "findings/" + name && name.ends_with(".sh")) << file;
    EXPECT_NE(page.find("| [" + name.substr(0, name.size() - 3) + "](" + name + ") | "),
              std::string::npos)
        << name << " has no line";
    EXPECT_NE(fs::status(kRoot / file).permissions() & fs::perms::owner_exec, fs::perms::none)
        << file;
    EXPECT_TRUE(text.starts_with("#!/usr/bin/env bash\n# ")) << file;
    for (const std::string line : {"set -euo pipefail", "trap 'rm -rf \"$folder\"' EXIT"})
      EXPECT_NE(text.find('\n' + line + '\n'), std::string::npos) << file << " lacks " << line;
    EXPECT_NE(text.find("exit 1"), std::string::npos) << file << " does not fail";
    EXPECT_EQ(text.find("clamor bake"), std::string::npos) << file << " runs Clamor";
  }
  EXPECT_GE(scripts, 6u);
}

TEST(ContinuousIntegration, RunsWhatDevelopersRun) {
  const std::string script = read_text(kRoot / ".ci/run");
  EXPECT_NE(script.find("tools/test\""), std::string::npos) << script;
}

}  // namespace
}  // namespace clamor::testing
