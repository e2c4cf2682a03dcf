// test_filters_test.cpp: the filters in tests/CMakeLists.txt name suites and files that exist, and
// the tags of tests are those that it leaves out.

#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

// The values of all arguments NAME "value" in a CMake file, split at `separator`.
std::vector<std::string> values_of(const std::string& name, char separator) {
  std::vector<std::string> values;
  const std::string text = read_text(kRoot / "tests/CMakeLists.txt");
  const std::regex argument("[( \\n]" + name + " \"([^\"]+)\"");
  for (std::sregex_iterator found(text.begin(), text.end(), argument), end; found != end; ++found)
    for (const std::string& value : split((*found)[1], separator)) values.push_back(value);
  return values;
}

struct Tests {
  std::vector<std::string> files;  // without _test.cpp
  std::vector<std::string> names;  // SUITE.TEST
};

Tests all_tests() {
  Tests tests;
  static const std::regex kTest(R"(TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\))");
  static const std::string kEnd = "_test.cpp";
  for (const std::string& file : files_in("tests")) {
    if (!file.ends_with(kEnd)) continue;
    tests.files.push_back(file.substr(0, file.size() - kEnd.size()));
    const std::string text = read_text(kRoot / file);
    for (std::sregex_iterator found(text.begin(), text.end(), kTest), end; found != end; ++found)
      tests.names.push_back((*found)[1].str() + "." + (*found)[2].str());
  }
  return tests;
}

// A tag that is written otherwise would be no tag, and the test run where it was to be left out.
TEST(TestFilters, TagTestsInOneWay) {
  static const std::regex kTag("[^_]+(_NoAsan)?(_NoTsan)?");
  int tagged = 0;
  for (const std::string& name : all_tests().names) {
    EXPECT_TRUE(std::regex_match(name, kTag)) << name;
    if (name.find('_') != std::string::npos) ++tagged;
  }
  EXPECT_GT(tagged, 100);
}

TEST(TestFilters, NameFilesThatExist) {
  const Tests tests = all_tests();
  for (const std::string kind : {"NO_ASAN_FILES", "TSAN_FILES"})
    for (const std::string& pattern : values_of(kind, '|'))
      EXPECT_TRUE(std::ranges::any_of(tests.files,
                                      [&](const std::string& file) {
                                        return std::regex_search(file,
                                                                 std::regex("/" + pattern + "$"));
                                      }))
          << kind << " " << pattern;
  EXPECT_GT(values_of("NO_ASAN_FILES", '|').size(), 10u);
  EXPECT_GT(values_of("TSAN_FILES", '|').size(), 5u);
}

TEST(TestFilters, NameSuitesThatExist) {
  const Tests tests = all_tests();
  for (const std::string& pattern : values_of("APART", '|'))
    EXPECT_TRUE(std::ranges::any_of(tests.names, [&](const std::string& name) {
      return std::regex_match(name.substr(0, name.find('.')), std::regex(pattern));
    })) << pattern;
  EXPECT_GT(values_of("APART", '|').size(), 5u);
}

}  // namespace
}  // namespace clamor::testing
