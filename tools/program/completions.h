// completions.h: scripts with which shells complete the commands and options of the program.
//
// Where a value has no list of words, shells offer files.
#pragma once

#include <span>
#include <string>

#include "tools/program/command_description.h"

namespace clamor {

std::string bash_completion(std::span<const CommandDescription> commands);
std::string zsh_completion(std::span<const CommandDescription> commands);
std::string fish_completion(std::span<const CommandDescription> commands);

}  // namespace clamor
