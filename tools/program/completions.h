// completions.h: scripts with which shells complete the commands and options of the program.
//
// Where a value has no list of words, shells offer files. The names of `subcommands` begin with
// that of a command and a blank, as in "farm status".
#pragma once

#include <span>
#include <string>

#include "tools/program/command_description.h"

namespace clamor {

std::string bash_completion(std::span<const CommandDescription> commands,
                            std::span<const CommandDescription> subcommands);
std::string zsh_completion(std::span<const CommandDescription> commands,
                           std::span<const CommandDescription> subcommands);
std::string fish_completion(std::span<const CommandDescription> commands,
                            std::span<const CommandDescription> subcommands);

}  // namespace clamor
