// header_table.h: what the C compiler says of an interface header, as lines that the tests of the
// bindings compare with their declarations:
//
//   constant NAME VALUE
//   struct NAME BYTES
//   member STRUCT NAME OFFSET BYTES
//   function NAME RESULT ARGUMENT...    p: a pointer; i4, u4, u8, f8: a number; v: nothing
#pragma once

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/temporary_file.h"

namespace clamor::testing {

namespace header_table_parts {

inline std::vector<std::string> matches(const std::string& text, const std::regex& pattern,
                                        std::size_t group) {
  std::vector<std::string> found;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), pattern);
       it != std::sregex_iterator(); ++it)
    found.push_back((*it)[group]);
  return found;
}

// The names that a structure's body declares.
inline std::vector<std::string> members(const std::string& body) {
  static const std::regex kDeclaration("([^;]+);"), kFunction(R"(\(\*\s*(\w+)\))"),
      kName(R"((\w+)\s*(?:\[[^\]]*\])?\s*(?:,|$))");
  std::vector<std::string> names;
  for (const std::string& declaration : matches(body, kDeclaration, 1)) {
    std::smatch function;
    if (std::regex_search(declaration, function, kFunction))
      names.push_back(function[1]);
    else
      for (const std::string& name : matches(declaration, kName, 1)) names.push_back(name);
  }
  return names;
}

// The C expression that prints a type's kind and size.
inline std::string print_type(std::string type) {
  if (type.find('*') != std::string::npos) return "  printf(\" p\");\n";
  type = std::regex_replace(type, std::regex(R"(^\s*(const )?|\s+$)"), "");
  if (type == "void") return "  printf(\" v\");\n";
  return "  printf(\" %c%zu\", KIND(" + type + "), sizeof(" + type + "));\n";
}

inline std::string print_function(const std::smatch& function) {
  std::string lines = "  printf(\"function " + function[2].str() + "\");\n";
  lines += print_type(function[1]);
  static const std::regex kArgument("[^,]+"), kTrailingName(R"(\w+\s*$)");
  for (const std::string& argument : matches(function[3], kArgument, 0))
    if (argument != "void") lines += print_type(std::regex_replace(argument, kTrailingName, ""));
  return lines + "  printf(\"\\n\");\n";
}

}  // namespace header_table_parts

// The table of the header at `path`, whose functions begin with API, as CLAMOR_API.
inline std::string header_table(const std::string& path, const std::string& api) {
  namespace parts = header_table_parts;
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::string without_comments;  // by hand, as std::regex would recurse once for each character
  for (std::size_t begin = 0, end; begin < text.size(); begin = end) {
    const std::size_t comment = std::min(text.find("/*", begin), text.size());
    without_comments += text.substr(begin, comment - begin);
    end = comment == text.size() ? comment : text.find("*/", comment) + 2;
  }
  std::string lines;
  const std::regex macro(R"(#define (CLAMOR_\w+) \d+\b)"), in_enum(R"(\b(CLAMOR_\w+) = -?\d+)");
  for (const std::regex& pattern : {macro, in_enum})
    for (const std::string& name : parts::matches(without_comments, pattern, 1))
      lines += "  printf(\"constant " + name + " %d\\n\", (int)" + name + ");\n";
  const std::regex structure(R"(typedef struct (\w+) \{([^}]*)\})");
  for (auto it = std::sregex_iterator(without_comments.begin(), without_comments.end(), structure);
       it != std::sregex_iterator(); ++it) {
    const std::string name = (*it)[1];
    lines += "  printf(\"struct " + name + " %zu\\n\", sizeof(" + name + "));\n";
    for (const std::string& member : parts::members((*it)[2]))
      lines += "  printf(\"member " + name + " " + member + " %zu %zu\\n\", offsetof(" + name +
               ", " + member + "), sizeof(((" + name + "*)0)->" + member + "));\n";
  }
  const std::regex function("\\n" + api + R"(\s+([\w\s*]*?[\s*])(clamor_\w+)\(([^)]*)\);)");
  for (auto it = std::sregex_iterator(without_comments.begin(), without_comments.end(), function);
       it != std::sregex_iterator(); ++it)
    lines += parts::print_function(*it);

  const TemporaryFile source(".c", "#include <stddef.h>\n#include <stdio.h>\n#include \"" + path +
                                       "\"\n#define KIND(T) ((T)0.5 != 0 ? 'f' : (T)-1 < 0 ? 'i' : "
                                       "'u')\nint main(void) {\n" +
                                       lines + "}\n"),
      program(".out"), table(".txt");
  const std::string command = "cc -std=c99 -o " + program.path() + " " + source.path() + " && " +
                              program.path() + " >" + table.path();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return table.bytes();
}

}  // namespace clamor::testing
