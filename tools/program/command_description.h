// command_description.h: what --help says about a command, as data, for its man page and the
// completions of shells.
#pragma once

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
};

// Given to a command as its output, it receives the command's description, and the command does
// nothing else.
class DescriptionStream : public std::ostringstream {
 public:
  CommandDescription description;
};

}  // namespace clamor
