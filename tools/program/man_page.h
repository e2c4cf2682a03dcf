// man_page.h: the man pages of the program, in the man macros of roff.
#pragma once

#include <span>
#include <string>

#include "tools/program/command_description.h"

namespace clamor {

// The name of the page of a command or subcommand, as in "clamor-bake" and "clamor-farm-status".
std::string man_page_name(const CommandDescription& command);

// The page of one command.
std::string man_page(const CommandDescription& command);

// The page of the program, "clamor.1", with a list of its commands.
std::string man_page(std::span<const CommandDescription> commands);

}  // namespace clamor
