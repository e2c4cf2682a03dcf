// help.h: the text of --help, fitted to the width of the terminal.
#pragma once

#include <cstddef>
#include <string>

#include "tools/program/command_description.h"

namespace clamor {

// The help of one command. Its example is continued over lines with backslashes, so that it can be
// copied.
std::string help_text(const CommandDescription& command, std::size_t columns);

// An entry of a list: the name, and the text beside it, or below it where that is too narrow.
std::string list_entry(const std::string& name, const std::string& text, std::size_t name_columns,
                       std::size_t columns);

// A command to copy, continued over lines with backslashes.
std::string example_lines(const std::string& command, std::size_t columns);

}  // namespace clamor
