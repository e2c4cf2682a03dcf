// Tests that options mean the same in every command, and that tools/README.md lists them all.
#include <array>
#include <map>
#include <regex>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "tests/tools/run_clamor.h"
#include "tools/program/progress.h"

namespace clamor {
namespace {

using Run = int (*)(std::span<const std::string>, std::ostream&, std::ostream&);
constexpr std::array<std::pair<const char*, Run>, 18> kRunners = {{
    {"bake", run_bake},
    {"merge", run_merge},
    {"farm", run_farm},
    {"farm status", run_farm},
    {"farm resume", run_farm},
    {"farm merge", run_farm},
    {"inspect", run_inspect},
    {"report", run_report},
    {"diff", run_diff},
    {"play", run_play},
    {"view", run_view},
    {"render", run_render},
    {"impulse", run_impulse},
    {"compare", run_compare},
    {"experiment", run_experiment},
    {"materials", run_materials},
    {"devices", run_devices},
    {"bench", run_bench},
}};

CommandDescription described(const std::string& name, Run run) {
  std::vector<std::string> words;
  if (name.starts_with("farm ")) words.push_back(name.substr(5));
  DescriptionStream stream;
  run(words, stream, stream);
  return stream.description;
}

// The long options, with the commands that take them and their values there.
using Commands = std::map<std::string, std::string>;
std::map<std::string, Commands> options() {
  std::map<std::string, Commands> all;
  for (const auto& [name, run] : kRunners)
    for (const OptionDescription& option : described(name, run).options)
      all[option.names.back()][name] = option.value;
  return all;
}

TEST(Options, TakeTheSameKindOfValueInEveryCommand) {
  for (const auto& [option, commands] : options()) {
    if (option == "--voices") continue;  // bench takes a list of them
    if (option == "--seed") continue;  // whole numbers, of which that of a bake may be unset
    for (const auto& [command, value] : commands)
      EXPECT_EQ(value, commands.begin()->second)
          << option << " of " << command << " and of " << commands.begin()->first;
  }
}

TEST(Options, AreAllInTheTableOfThePageWithTheirCommands) {
  std::map<std::string, std::set<std::string>> table, expected;
  std::istringstream page(testing::read(std::string(testing::kSourceDir) + "/tools/README.md"));
  const std::regex row("\\| `(?:-[a-z], )?(--[a-z-]+)[^`]*` \\| ([a-z, ]+) \\| [^|]+ \\|");
  for (std::string line; std::getline(page, line);) {
    std::smatch cells;
    if (!std::regex_match(line, cells, row)) continue;
    EXPECT_FALSE(table.contains(cells[1])) << "two meanings: " << line;
    std::istringstream commands(cells[2]);
    for (std::string command; std::getline(commands >> std::ws, command, ',');)
      table[cells[1]].insert(command);
  }
  std::string missing;
  for (const auto& [option, commands] : options()) {
    for (const auto& [command, value] : commands) expected[option].insert(command);
    if (commands.size() == kRunners.size()) expected[option] = {"all"};
    if (expected[option] == table[option]) continue;
    missing += "| `" + option + "` | ";
    for (const std::string& command : expected[option])
      missing += (command == *expected[option].begin() ? "" : ", ") + command;
    missing += " | |\n";
  }
  EXPECT_EQ(missing, "") << "rows that are missing or wrong";
  for (const auto& [option, commands] : table)
    EXPECT_TRUE(expected.contains(option)) << option << " is in the table, but no command has it";
}

TEST(Speed, BelowRealTimeIsSaidToBeSlower) {
  EXPECT_EQ(in_real_times(4), "4.0 times faster than real time");
  EXPECT_EQ(in_real_times(0.25), "4.0 times slower than real time");
}

}  // namespace
}  // namespace clamor
