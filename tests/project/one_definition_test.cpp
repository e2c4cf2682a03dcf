// one_definition_test.cpp: two types of one namespace may not share a name.
//
// The linker keeps one of two functions of the same name, such as the members of a vector of such a
// type, so that code compiled for one type runs with the other. No compiler warns of that.

#include <map>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

// The types that a file defines at namespace scope, with their namespaces. Those of anonymous
// namespaces are left out, since each file has its own.
std::vector<std::string> types_of(const std::string& text) {
  static const std::regex kOpens(R"(^(?:inline )?namespace ?([\w:]*) ?\{)");
  static const std::regex kDefines(
      R"(^(?:struct|class|union|enum class|enum) (?:alignas\(\w+\) )?(\w+)(?: final)?(?: : [^;]*)? ?\{)");
  std::vector<std::string> types, namespaces;
  for (const std::string& line : lines_of(text)) {
    std::smatch match;
    if (std::regex_search(line, match, kOpens) && line.find('}') == std::string::npos)
      namespaces.push_back(match[1]);
    else if (line.starts_with("}  // namespace") && !namespaces.empty())
      namespaces.pop_back();
    else if (std::regex_search(line, match, kDefines) && !std::ranges::count(namespaces, ""))
      types.push_back((namespaces.empty() ? "" : namespaces.back() + "::") + match[1].str());
  }
  return types;
}

TEST(OneDefinition, HoldsForTheTypesOfAllFiles) {
  std::map<std::string, std::string> file_of_type;
  for (const std::string folder : {"common", "formats", "bake", "runtime", "tools", "tests"})
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file)) continue;
      for (const std::string& type : types_of(read_text(kRoot / file))) {
        const auto [first, is_new] = file_of_type.emplace(type, file);
        EXPECT_TRUE(is_new) << file << " defines " << type << ", as does " << first->second;
      }
    }
  EXPECT_GT(file_of_type.size(), 200u);
}

TEST(OneDefinition, IsCheckedInNamespacesWithNames) {
  EXPECT_EQ(types_of("namespace clamor {\n"
                     "struct A {\n};\n"
                     "namespace {\nclass B {\n};\n}  // namespace\n"
                     "class C final : public A {\n};\n"
                     "struct C::State {\n};\n"
                     "struct D;\n"
                     "}  // namespace clamor\n"
                     "enum class E { kOne };\n"),
            (std::vector<std::string>{"clamor::A", "clamor::C", "E"}));
}

}  // namespace
}  // namespace clamor::testing
