// include_closure_test.cpp: how far headers reach, and that each file includes what it names.
//
// The presets release, asan and tsan compile the files of a folder together, so a compiler does not
// notice a missing include that another file of the folder has. These tests read the text instead.

#include <cctype>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

// A line without its strings and its comment.
std::string code_of(std::string_view line) {
  std::string code;
  for (std::size_t i = 0; i < line.size() && !line.substr(i).starts_with("//"); ++i) {
    code += line[i];
    if (line[i] != '"') continue;
    for (++i; i < line.size() && line[i] != '"'; ++i)
      if (line[i] == '\\') ++i;
    code += '"';
  }
  return code;
}

struct SourceFile {
  std::set<std::string> our_includes, other_includes;
  std::set<std::string> types, inner_types;  // defined in a namespace, defined further in
  std::set<std::string> forward_types;       // declared only
  std::set<std::string> std_names, names;    // after std::, after neither :: nor . nor >
};

SourceFile read_source(const std::string& file) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  static const std::regex kType(
      R"(^( *)(?:struct|class|enum class|union|using) (?:\[\[nodiscard\]\] )?(\w+)( :| \{|;| final| =))");
  static const std::regex kOpaqueC(R"(^typedef struct (\w+) \w+;)");
  SourceFile source;
  for (const std::string& line : lines_of(read_text(kRoot / file))) {
    std::smatch match;
    if (line.find("include") != std::string::npos && std::regex_search(line, match, kInclude)) {
      (match[1] == "<" ? source.other_includes : source.our_includes).insert(match[2]);
      continue;
    }
    const std::string code = code_of(line);
    if (std::regex_search(code, match, kOpaqueC)) source.forward_types.insert(match[1]);
    if (std::regex_search(code, match, kType))
      (match[3] == ";"          ? source.forward_types
       : match[1].length() == 0 ? source.types
                                : source.inner_types)
          .insert(match[2]);
    for (std::size_t begin = 0, end; begin < code.size(); begin = end) {
      const auto is_word = [&](std::size_t i) {
        return std::isalnum(static_cast<unsigned char>(code[i])) || code[i] == '_';
      };
      end = begin + 1;
      if (!is_word(begin)) continue;
      while (end < code.size() && is_word(end)) ++end;
      const std::string_view before = std::string_view(code).substr(0, begin);
      if (before.ends_with("std::"))
        source.std_names.insert(code.substr(begin, end - begin));
      else if (before.empty() || std::string_view(":.>").find(before.back()) == before.npos)
        source.names.insert(code.substr(begin, end - begin));
    }
  }
  return source;
}

using IncludeGraph = std::map<std::string, SourceFile>;

const IncludeGraph& include_graph() {
  static const IncludeGraph graph = [] {
    IncludeGraph all;
    for (const std::string folder : {"common", "formats", "bake", "runtime", "tools", "tests"})
      for (const std::string& file : files_in(folder))
        if (is_code(file)) all[file] = read_source(file);
    return all;
  }();
  return graph;
}

// All files of ours that a file includes, directly or not, and itself.
std::set<std::string> reached_by(const std::string& file) {
  std::set<std::string> reached{file};
  std::vector<std::string> open{file};
  while (!open.empty()) {
    const std::string next = open.back();
    open.pop_back();
    for (const std::string& header : include_graph().at(next).our_includes)
      if (include_graph().contains(header) && reached.insert(header).second) open.push_back(header);
  }
  return reached;
}

TEST(IncludeClosure, OfThePlayerAndOfLevelsIsSmall) {
  EXPECT_LT(reached_by("runtime/player/player.h").size() - 1, 15u);
  std::size_t files_with_levels = 0;
  for (const auto& [file, source] : include_graph())
    files_with_levels += reached_by(file).contains("formats/level/level.h");
  EXPECT_LT(files_with_levels, 220u);  // half of them tests that import one
}

// What a reader of one file may have to know. The listener's engine and its sampler are where all
// folders of the runtime meet, and the experiment of measured rooms imports, bakes and measures.
TEST(IncludeClosure, OfAFileHasAtMostAHundredHeaders) {
  const std::map<std::string, std::size_t> meeting_places = {
      {"runtime/engine/auralizer.cpp", 141},
      {"runtime/engine/sampling_pipeline.cpp", 135},
      {"tools/experiments/experiment_motion_times.cpp", 101},
      {"tools/experiments/experiment_room.cpp", 105}};
  for (const auto& [file, source] : include_graph()) {
    if (file.starts_with("tests/")) continue;
    const auto exception = meeting_places.find(file);
    EXPECT_LE(reached_by(file).size() - 1,
              exception == meeting_places.end() ? 100 : exception->second)
        << file;
  }
}

// Any header declares what <cstddef> and <utility> do.
TEST(IncludeClosure, HasTheStandardHeaderOfEachNameInUse) {
  const std::map<std::string, std::set<std::string>> names_of = {
      {"algorithm", {"clamp", "max", "min", "sort"}},
      {"array", {"array"}},
      {"atomic", {"atomic"}},
      {"bit", {"bit_cast"}},
      {"chrono", {"chrono"}},
      {"cmath", {"sqrt"}},
      {"complex", {"complex"}},
      {"cstdint", {"int32_t", "int64_t", "uint8_t", "uint16_t", "uint32_t", "uint64_t"}},
      {"cstring", {"memcpy"}},
      {"deque", {"deque"}},
      {"filesystem", {"filesystem"}},
      {"functional", {"function"}},
      {"limits", {"numeric_limits"}},
      {"map", {"map"}},
      {"memory", {"make_unique", "shared_ptr", "unique_ptr"}},
      {"mutex", {"mutex"}},
      {"numeric", {"accumulate", "iota"}},
      {"optional", {"optional"}},
      {"set", {"set"}},
      {"span", {"span"}},
      {"string", {"string", "to_string"}},
      {"thread", {"thread"}},
      {"unordered_map", {"unordered_map"}},
      {"variant", {"variant"}},
      {"vector", {"vector"}}};
  for (const auto& [file, source] : include_graph()) {
    std::set<std::string> included;
    for (const std::string& reached : reached_by(file))
      included.merge(std::set(include_graph().at(reached).other_includes));
    for (const auto& [header, names] : names_of)
      for (const std::string& name : names)
        EXPECT_TRUE(!source.std_names.contains(name) || included.contains(header))
            << file << " names std::" << name << " and needs <" << header << ">";
  }
}

// A name that is a type in one header and nothing else anywhere.
TEST(IncludeClosure, HasTheHeaderOfEachTypeInUse) {
  std::map<std::string, std::set<std::string>> headers_of;
  std::set<std::string> ambiguous;
  for (const auto& [file, source] : include_graph()) {
    const bool is_header = file.ends_with(".h") && !file.starts_with("tests/");
    for (const std::string& type : source.types)
      if (is_header)
        headers_of[type].insert(file);
      else
        ambiguous.insert(type);
    ambiguous.insert(source.inner_types.begin(), source.inner_types.end());
  }
  EXPECT_GT(headers_of.size(), 300u);
  for (const auto& [file, source] : include_graph()) {
    if (file.starts_with("tests/")) continue;  // suites are named after types
    const std::set<std::string> reached = reached_by(file);
    for (const std::string& name : source.names) {
      const auto found = headers_of.find(name);
      if (found == headers_of.end() || ambiguous.contains(name)) continue;
      bool is_there = false;
      for (const std::string& header : found->second) is_there |= reached.contains(header);
      if (file.ends_with(".h"))  // a forward declaration does
        for (const std::string& header : reached)
          is_there |= include_graph().at(header).forward_types.contains(name);
      EXPECT_TRUE(is_there) << file << " names " << name << " and needs " << *found->second.begin();
    }
  }
}

}  // namespace
}  // namespace clamor::testing
