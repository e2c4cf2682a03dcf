// clamor_sequences_test.cpp: random sequences of calls of the C interface (call_sequence.h), the
// same in every run. CLAMOR_CALLS=10000000 makes as many calls.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/build_paths.h"
#include "tests/library/call_sequence.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

std::uint64_t wanted_calls() {
  const char* const calls = std::getenv("CLAMOR_CALLS");
  if (calls != nullptr) return std::strtoull(calls, nullptr, 10);
  return testing::kSanitized ? 3000 : 8000;
}

// Every broken promise aborts. Sanitizers look for bad accesses and leaks meanwhile.
TEST(ClamorSequences, KeepTheirPromisesWhateverIsCalled) {
  std::mt19937 random(1);
  const std::uint64_t wanted = wanted_calls();
  std::uint64_t calls = 0, sequences = 0;
  while (calls < wanted) {
    std::vector<std::uint8_t> bytes(16 + random() % 3000);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    calls += testing::make_call_sequence(bytes);
    ++sequences;
  }
  RecordProperty("calls", std::to_string(calls));
  RecordProperty("sequences", std::to_string(sequences));
}

using Errors = std::set<clamor_result>;

// The errors that a comment of clamor.h names: "Errors: HANDLE, FILE." or "Errors: as above, FILE."
Errors named_errors(const std::string& comment, const Errors& above) {
  static const std::map<std::string, clamor_result> kErrors = {
      {"ARGUMENT", CLAMOR_ERROR_ARGUMENT}, {"HANDLE", CLAMOR_ERROR_HANDLE},
      {"FILE", CLAMOR_ERROR_FILE},         {"MEMORY", CLAMOR_ERROR_MEMORY},
      {"FULL", CLAMOR_ERROR_FULL},         {"BUSY", CLAMOR_ERROR_BUSY},
      {"STATE", CLAMOR_ERROR_STATE},       {"NOT_FOUND", CLAMOR_ERROR_NOT_FOUND}};
  const std::size_t begin = comment.find("Errors:");
  if (begin == std::string::npos) return {};
  const std::string sentence = comment.substr(begin, comment.find('.', begin) - begin);
  Errors named;
  if (sentence.find("as above") != std::string::npos) named = above;
  for (const auto& [name, code] : kErrors)
    if (sentence.find(name) != std::string::npos) named.insert(code);
  return named;
}

// The functions of clamor.h and the errors that their comments name.
std::map<std::string, Errors> documented_functions() {
  std::ifstream file(std::string(testing::kSourceDir) + "/runtime/clamor.h");
  const std::string header{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  static const std::regex kName(R"(^CLAMOR_API [\w* ]*?(clamor_\w+)\((clamor_context\*)?)"),
      kSameAs(R"(As (clamor_\w+)\(\))"), kNewLine(R"(\n \* )");
  std::map<std::string, Errors> functions;
  Errors above;
  for (std::size_t at = 0; (at = header.find("\nCLAMOR_API ", at)) != std::string::npos; ++at) {
    const std::size_t comment_begin = header.rfind("/*", at);
    const std::string comment = std::regex_replace(
        header.substr(comment_begin, header.find("*/", comment_begin) - comment_begin), kNewLine,
        " ");
    std::smatch name, same;
    const std::string declaration = header.substr(at + 1, header.find(';', at) - at);
    if (!std::regex_search(declaration, name, kName)) {
      ADD_FAILURE() << "unexpected declaration: " << declaration;
      continue;
    }
    Errors errors = std::regex_search(comment, same, kSameAs) ? functions[same[1]]
                                                              : named_errors(comment, above);
    // Every function refuses a null context, says the beginning of the header.
    if (name[2].matched) errors.insert(CLAMOR_ERROR_ARGUMENT);
    above = functions[name[1]] = errors;
  }
  return functions;
}

TEST(ClamorSequences, CallEveryFunctionAndAllowTheErrorsThatTheHeaderNames) {
  const std::set<std::string> without_entry = {
      "clamor_destroy",     // returns nothing; every sequence ends with it
      "clamor_version",     // takes nothing; the entry of clamor_result_text() calls both
      "clamor_abi_version"  //
  };
  std::map<std::string, Errors> documented = documented_functions(), called;
  EXPECT_GE(documented.size(), 30u);
  for (const std::string& name : without_entry) EXPECT_EQ(documented.erase(name), 1u) << name;
  for (const testing::Call& call : testing::all_calls())
    EXPECT_TRUE(called.emplace(call.name, Errors(call.errors.begin(), call.errors.end())).second)
        << call.name << " has two entries";
  for (const auto& [name, errors] : documented) {
    const auto found = called.find(name);
    if (found == called.end())
      ADD_FAILURE() << name << " has no entry in the tables of tests/library/*_calls.cpp";
    else
      EXPECT_EQ(found->second, errors) << name;
  }
  for (const auto& [name, errors] : called) EXPECT_EQ(documented.count(name), 1u) << name;
}

}  // namespace
}  // namespace clamor
