// command_description.h: what --help says about a command, as data, and the texts that are made of
// it: the help, man pages and the completions of shells.
#pragma once

#include <cstddef>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace clamor {

struct OptionDescription {
  std::vector<std::string> names;  // "-o", "--output"; one name without dashes if positional
  std::string value;               // "TEXT", "INT"; empty for a flag
  std::string usual;               // the default; may be empty
  std::string help;
  std::vector<std::string> words;  // values that shells offer; may be empty
  bool required = false, repeatable = false;
};

struct CommandDescription {
  std::string name;     // "bake", "farm status"
  std::string summary;  // a line, without a full stop
  std::string purpose;  // lines that begin with blanks stay as they are
  std::string example;
  std::vector<OptionDescription> positionals, options;

  bool is_subcommand() const { return name.find(' ') != std::string::npos; }
};

// Given to a command as its output, it receives the command's description, and the command does
// nothing else.
class DescriptionStream : public std::ostringstream {
 public:
  CommandDescription description;
};

// The help of one command, fitted to the width of the terminal. Its example is continued over lines
// with backslashes, so that it can be copied.
std::string help_text(const CommandDescription& command, std::size_t columns);

// An entry of a list: the name, and the text beside it, or below it where that is too narrow.
std::string list_entry(const std::string& name, const std::string& text, std::size_t name_columns,
                       std::size_t columns);

// A command to copy, continued over lines with backslashes.
std::string example_lines(const std::string& command, std::size_t columns);

// The man page of a command or subcommand in the man macros of roff, and its name, as in
// "clamor-bake" and "clamor-farm-status".
std::string man_page(const CommandDescription& command);
std::string man_page_name(const CommandDescription& command);

// The page of the program, "clamor.1", with a list of its commands.
std::string man_page(std::span<const CommandDescription> commands);

// Scripts with which shells complete the commands, subcommands and options of the program. Where a
// value has no list of words, shells offer files.
std::string bash_completion(std::span<const CommandDescription> commands);
std::string zsh_completion(std::span<const CommandDescription> commands);
std::string fish_completion(std::span<const CommandDescription> commands);

}  // namespace clamor
