// packaging_test.cpp: checks the recipes of package managers, as far as a reader can.
#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/project/source_tree.h"
#include "tests/shell.h"
#include "tests/temporary_file.h"

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
  if (!has("python3")) GTEST_SKIP() << "not on this machine: python3";
  for (const char* recipe : {"conanfile.py", "test_package/conanfile.py"}) {
    const std::string path = (kRoot / "tools/packaging/conan" / recipe).string();
    EXPECT_EQ(
        std::system(
            ("python3 -c 'import ast, sys; ast.parse(open(sys.argv[1]).read())' " + path).c_str()),
        0)
        << path;
  }
}

TEST(Packaging, RefusesAGodotAddOnThatLacksALibrary) {
  if (!has("python3")) GTEST_SKIP() << "not on this machine: python3";
  const std::string addon = (kRoot / "runtime/bindings/godot/addons/clamor").string();
  const std::vector<std::string> files = {"bin/libclamor_godot.so",
                                          "bin/libclamor.so.0",
                                          "bin/libclamor_bake.so.0",
                                          "THIRD_PARTY",
                                          "bin/libclamor_godot.dll",
                                          "bin/libclamor.dll",
                                          "bin/libclamor_bake.dll",
                                          "THIRD_PARTY_WINDOWS",
                                          "LICENSE"};
  for (const std::string without : {"", "bin/libclamor.dll", "bin/libclamor_bake.so.0"}) {
    const TemporaryFile archive(".zip");
    std::string command =
        "python3 -c 'import sys, zipfile\n"
        "archive = zipfile.ZipFile(sys.argv[1], \"w\")\n"
        "archive.write(sys.argv[2], \"addons/clamor/clamor.gdextension\")\n"
        "for file in sys.argv[3:]: archive.writestr(\"addons/clamor/\" + file, \"\")' " +
        archive.path() + " " + addon + "/clamor.gdextension";
    for (const std::string& file : files)
      if (file != without) command += " " + file;
    run(command);
    const TemporaryFile said(".txt");
    const int status = std::system(((kRoot / "tools/packaging/check_godot").string() + " " +
                                    archive.path() + " >" + said.path() + " 2>&1")
                                       .c_str());
    EXPECT_EQ(status == 0, without.empty()) << said.bytes();
    EXPECT_EQ(said.bytes().find(" lacks " + without) == std::string::npos, without.empty());
  }
}

}  // namespace
}  // namespace clamor::testing
