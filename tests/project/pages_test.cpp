// pages_test.cpp: README.md and the pages of the rooms are true: their links, commands, options and
// examples exist.

#include <array>
#include <cctype>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/project/source_tree.h"
#include "tests/shell.h"

namespace clamor::testing {
namespace {

namespace fs = std::filesystem;

const std::array<std::string, 22> kPages = {"README.md",
                                            "CHANGELOG.md",
                                            "tools/contributing.md",
                                            "runtime/glossary.md",
                                            "assets/README.md",
                                            "bake/README.md",
                                            "findings/README.md",
                                            "formats/README.md",
                                            "formats/bake_format.md",
                                            "formats/scripts.md",
                                            "formats/blender/README.md",
                                            "runtime/README.md",
                                            "tests/README.md",
                                            "tests/benchmarks/README.md",
                                            "tools/README.md",
                                            "tools/farm/README.md",
                                            "tools/packaging/README.md",
                                            "runtime/bindings/README.md",
                                            "runtime/bindings/csharp/README.md",
                                            "runtime/bindings/godot/README.md",
                                            "runtime/bindings/python/README.md",
                                            "runtime/examples/README.md"};

// The anchor that Markdown renderers give a heading: lower case, spaces as dashes, no punctuation.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char letter : heading)
    if (std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '-' || letter == '_')
      anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    else if (letter == ' ')
      anchor += '-';
  return anchor;
}

bool has_heading(const std::string& page, const std::string& anchor) {
  for (const std::string& line : lines_of(page))
    if (const auto text = line.find_first_not_of('#');
        line.starts_with('#') && text != std::string::npos && line[text] == ' ' &&
        anchor_of(line.substr(text + 1)) == anchor)
      return true;
  return false;
}

TEST(Pages, LinkToFilesAndHeadingsThatExist) {
  static const std::regex kLink(R"re((?:\]\(|href=")([^)"#\s]*)(?:#([^)"\s]*))?[)"])re");
  std::size_t links = 0;
  for (const std::string& page : kPages) {
    const std::string text = read_text(kRoot / page);
    EXPECT_FALSE(text.empty()) << page;
    for (auto link = std::sregex_iterator(text.begin(), text.end(), kLink);
         link != std::sregex_iterator(); ++link) {
      const std::string target = (*link)[1], anchor = (*link)[2];
      if (target.starts_with("http")) continue;
      ++links;
      const fs::path file = target.empty() ? kRoot / page : (kRoot / page).parent_path() / target;
      EXPECT_TRUE(fs::exists(file)) << page << " links to " << target;
      if (!anchor.empty()) {
        EXPECT_TRUE(has_heading(read_text(file), anchor)) << page << " links to " << (*link)[0];
      }
    }
  }
  EXPECT_GT(links, 50u);
}

TEST(Pages, OfEveryRoomAreLinkedFromTheFirst) {
  const std::string readme = read_text(kRoot / "README.md");
  for (const std::string& page : kPages)
    if (page != "README.md" && page != "formats/bake_format.md" && page != "formats/scripts.md" &&
        !page.starts_with("runtime/bindings/")) {  // pages of the rooms link to these
      EXPECT_NE(readme.find("](" + page), std::string::npos) << page;
    }
}

// The lines of a page's code blocks; a line that ends in a backslash is joined with the next.
std::vector<std::string> commands_of(const std::string& page) {
  std::vector<std::string> commands;
  bool inside = false, continued = false;
  for (std::string line : lines_of(page)) {
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

std::vector<std::string> commands_of_all_pages() {
  std::vector<std::string> all;
  for (const std::string& page : kPages)
    for (const std::string& line : commands_of(read_text(kRoot / page))) all.push_back(line);
  return all;
}

// One search answers each question of a stranger, in lines that are few enough to read.
TEST(Pages, AnswerThreeQuestionsByASearchThatPrintsAFewLines) {
  std::size_t searches = 0;
  for (const std::string& command : commands_of(read_text(kRoot / "runtime/README.md"))) {
    if (!command.starts_with("grep ")) continue;
    ++searches;
    const std::size_t lines = lines_of(run("cd '" + kRoot.string() + "' && " + command)).size();
    EXPECT_GE(lines, 1u) << command;
    EXPECT_LE(lines, 12u) << command;
  }
  EXPECT_EQ(searches, 3u);
}

TEST(Pages, ShowCommandsAndOptionsThatTheProgramHas) {
  static const std::regex kCommand(R"(^\s*(?:build/release/)?clamor ([a-z]+)(.*))");
  static const std::regex kOption(R"(\s(--?[a-z]+))");
  std::set<std::string> shown;
  for (const std::string& line : commands_of_all_pages()) {
    std::smatch command;
    if (!std::regex_search(line, command, kCommand)) continue;
    const std::string name = command[1], options = command[2];
    std::string source = read_text(kRoot / "tools/commands" / (name + "_command.cpp"));
    EXPECT_FALSE(source.empty()) << "there is no command " << name;
    if (name == "bake" || name == "view")
      source += read_text(kRoot / "tools/commands/bake_arguments.cpp");
    if (source.find("tools/commands/sound_options.h") != std::string::npos)
      source += read_text(kRoot / "tools/commands/sound_options.cpp");
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
  EXPECT_EQ(shown, (std::set<std::string>{"bake", "merge", "farm", "compare", "diff", "inspect",
                                          "render", "report", "impulse", "play", "materials",
                                          "devices", "experiment", "bench", "view"}));
}

TEST(Pages, ShowASidecarWithPresetsThatExist) {
  const std::string page = read_text(kRoot / "formats/README.md");
  const std::size_t begin = page.find("```json\n"), end = page.find("```\n", begin + 8);
  ASSERT_NE(end, std::string::npos);
  const auto sidecar = nlohmann::json::parse(page.substr(begin + 8, end - begin - 8));
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

TEST(Pages, ShowScriptsThatExistWithOptionsTheyTake) {
  static const std::regex kScript(R"(^\s*(tools/[a-z_]+)(.*))");
  static const std::regex kOption(R"(\s(--[a-z0-9]+))");
  std::set<std::string> shown;
  for (const std::string& line : commands_of_all_pages()) {
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
  EXPECT_EQ(shown, (std::set<std::string>{"tools/bundle", "tools/demo", "tools/in_debian", "tools/package",
                                          "tools/price", "tools/test"}));
}

}  // namespace
}  // namespace clamor::testing
