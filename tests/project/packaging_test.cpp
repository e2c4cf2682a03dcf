// packaging_test.cpp: checks the recipes of package managers, as far as a reader can.
#include <cstdlib>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

// CMake reads the version from clamor.h, and Conan's recipe too.
TEST(Packaging, NamesOneVersion) {
  const std::string header = read_text(kRoot / "runtime/clamor.h");
  std::string version;
  for (const char* part : {"MAJOR", "MINOR", "PATCH"}) {
    std::smatch number;
    ASSERT_TRUE(std::regex_search(
        header, number, std::regex("#define CLAMOR_VERSION_" + std::string(part) + " (\\d+)\n")));
    version += (version.empty() ? "" : ".") + number[1].str();
  }
  const auto port = nlohmann::json::parse(read_text(kRoot / "tools/packaging/vcpkg/vcpkg.json"));
  EXPECT_EQ(port.at("version"), version);
  EXPECT_NE(read_text(kRoot / "CHANGELOG.md").find("\n## " + version), std::string::npos);
}

TEST(Packaging, GivesVcpkgFieldsThatItKnows) {
  const std::set<std::string> known = {"name",    "version",  "description",
                                       "license", "supports", "dependencies"};
  const auto port = nlohmann::json::parse(read_text(kRoot / "tools/packaging/vcpkg/vcpkg.json"));
  for (const auto& [key, value] : port.items()) EXPECT_TRUE(known.contains(key)) << key;
  std::string previous;
  for (const auto& dependency : port.at("dependencies")) {
    const std::string name = dependency.is_string() ? dependency : dependency.at("name");
    EXPECT_LE(previous, name) << "vcpkg format-manifest sorts them";
    previous = name;
  }
}

TEST(Packaging, GivesConanPythonThatParses) {
  if (std::system("command -v python3 >/dev/null") != 0)
    GTEST_SKIP() << "not on this machine: python3";
  for (const char* recipe : {"conanfile.py", "test_package/conanfile.py"}) {
    const std::string path = (kRoot / "tools/packaging/conan" / recipe).string();
    EXPECT_EQ(
        std::system(
            ("python3 -c 'import ast, sys; ast.parse(open(sys.argv[1]).read())' " + path).c_str()),
        0)
        << path;
  }
}

}  // namespace
}  // namespace clamor::testing
