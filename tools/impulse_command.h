// impulse_command.h: clamor impulse, the response of a room and its parameters.
#pragma once

#include <iosfwd>
#include <span>
#include <string>

namespace clamor {

// `arguments` after the subcommand's name. Exit code 0, 1 for bad input, 2 for bad usage.
int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);

}  // namespace clamor
