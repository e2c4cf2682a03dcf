// help.cpp: the text of --help.
#include <sstream>
#include <vector>

#include "tools/program/command_description.h"
#include "tools/program/terminal_output.h"

namespace clamor {

namespace {

constexpr std::size_t kNameColumns = 34, kMinTextColumns = 36, kIndentBelow = 6;

std::string entry_of(const OptionDescription& option, std::size_t columns) {
  std::string name;
  for (const std::string& one : option.names) name += (name.empty() ? "" : ",") + one;
  if (!option.value.empty()) name += " " + option.value;
  if (!option.usual.empty()) name += "=" + option.usual;
  if (option.required && name.starts_with('-')) name += " REQUIRED";
  if (option.repeatable) name += " ...";
  return list_entry(name, option.help, kNameColumns, columns);
}

std::string list_of(const char* title, const std::vector<OptionDescription>& options,
                    std::size_t columns) {
  std::string text;
  for (const OptionDescription& option : options) text += entry_of(option, columns);
  return text.empty() ? "" : "\n" + std::string(title) + ":\n" + text;
}

// The lines of a text, each wrapped; those of a list begin with blanks.
std::string paragraphs(const std::string& text, std::size_t columns) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t gap = line.starts_with("  ") ? line.find("  ", 2) : std::string::npos;
    const std::size_t beside = gap == std::string::npos ? gap : line.find_first_not_of(' ', gap);
    out += beside == std::string::npos
               ? wrapped(line, columns) + "\n"
               : list_entry(line.substr(2, gap - 2), line.substr(beside), beside, columns);
  }
  return out;
}

// The words of a shell command: blanks in quotes divide none.
std::vector<std::string> shell_words(const std::string& command) {
  std::vector<std::string> words(1);
  char quote = 0;
  for (const char c : command) {
    if (c == ' ' && quote == 0) {
      words.emplace_back();
      continue;
    }
    if (c == '"' || c == '\'') quote = quote == 0 ? c : quote == c ? '\0' : quote;
    words.back() += c;
  }
  return words;
}

}  // namespace

std::string list_entry(const std::string& name, const std::string& text, std::size_t name_columns,
                       std::size_t columns) {
  const std::string left = "  " + wrapped(name, columns, kIndentBelow);
  const std::size_t indent =
      name_columns + kMinTextColumns <= columns ? name_columns : kIndentBelow;
  const std::string gap = left.size() + 2 <= indent ? std::string(indent - left.size(), ' ')
                                                    : "\n" + std::string(indent, ' ');
  return left + gap + wrapped(text, columns, indent) + "\n";
}

std::string example_lines(const std::string& command, std::size_t columns) {
  std::string lines = "example:";
  std::size_t column = lines.size();
  for (const std::string& word : shell_words(command)) {
    if (column + 1 + word.size() + 2 > columns && column > kIndentBelow) {
      lines += " \\\n" + std::string(kIndentBelow - 1, ' ');
      column = kIndentBelow - 1;
    }
    lines += " " + word;
    column += 1 + word.size();
  }
  return lines + "\n";
}

std::string help_text(const CommandDescription& command, std::size_t columns) {
  std::string usage = "Usage: clamor " + command.name + " [OPTIONS]";
  for (const OptionDescription& positional : command.positionals) {
    usage += " " + positional.names[0];
    if (positional.repeatable) usage += "...";
  }
  return paragraphs(command.purpose, columns) + wrapped(usage, columns, kIndentBelow) + "\n" +
         list_of("Positionals", command.positionals, columns) +
         list_of("Options", command.options, columns) + "\n" +
         example_lines(command.example, columns);
}

}  // namespace clamor
