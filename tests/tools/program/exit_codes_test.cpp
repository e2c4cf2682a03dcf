// Tests that commands end with the exit codes of the table in tools/README.md. Those of stopped
// programs are tested in whole_program/stopped_program_test.cpp.
#include <map>
#include <regex>

#include <gtest/gtest.h>

#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

// The rows of the table, by code.
std::map<int, std::string> table() {
  const std::string page = read(std::string(kSourceDir) + "/tools/README.md");
  std::map<int, std::string> rows;
  std::istringstream lines(page.substr(page.find("### Exit codes")));
  const std::regex row(R"(\| (\d+) \| (.*) \|)");
  std::smatch parts;
  for (std::string line; std::getline(lines, line) && !line.starts_with("## ");)
    if (std::regex_match(line, parts, row)) rows[std::stoi(parts[1])] = parts[2];
  return rows;
}

TEST(ExitCodes, AreThoseOfTheTable) {
  const auto rows = table();
  ASSERT_EQ(rows.size(), 5u);
  const std::string golden = std::string(kSourceDir) + "/tests/formats/golden/";
  const std::string a = golden + "3.0.clamor", same = golden + "3.1.clamor",
                    other = golden + "3.2.clamor", none = golden + "none.clamor";
  const auto expect = [&](const std::vector<std::string>& words, int code,
                          const std::string& says) {
    const Outcome outcome = clamor(words);
    EXPECT_EQ(outcome.code, code) << words[0] << ": " << outcome.err;
    ASSERT_TRUE(rows.contains(code));
    EXPECT_NE(rows.at(code).find(says), std::string::npos) << rows.at(code);
  };
  expect({"inspect", a}, kSuccess, "success");
  expect({"diff", a, same}, kSuccess, "sound the same");
  expect({"diff", a, other}, kDiffers, "of `diff`: the bakes differ");
  expect({"inspect", none}, kBadInput, "bad input");
  expect({"experiment", "walk", none, "-o", "x"}, kBadInput, "bad input");
  expect({"diff", a, none}, kDiffBadInput, "of `diff`");
  expect({"inspect"}, kBadUsage, "bad usage");
  expect({"diff", a, same, "--colour"}, kBadUsage, "bad usage");
  ASSERT_TRUE(rows.contains(kInterrupted));
  EXPECT_NE(rows.at(kInterrupted).find("Ctrl-C"), std::string::npos);
}

}  // namespace
}  // namespace clamor::testing
