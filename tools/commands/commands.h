// commands.h: the subcommands of the program, one file each.
//
// A subcommand gets the words after its name, writes results to `out` and everything else to `err`,
// and returns an exit code. The work is in the libraries; a subcommand parses, calls and prints.
#pragma once

#include <iosfwd>
#include <span>
#include <string>

#include "tools/program/command_description.h"
#include "tools/program/exit_codes.h"

namespace clamor {

int run_bake(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_merge(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_farm(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_inspect(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_report(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_diff(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_render(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_compare(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_experiment(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_play(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_view(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_bench(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_materials(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);
int run_devices(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);

// Writes the man pages and completions of these commands and their subcommands.
int run_manual(std::span<const CommandDescription> commands, std::span<const std::string> arguments,
               std::ostream& out, std::ostream& err);

// Runs the whole program; `arguments` excludes the program's name.
int run_clamor(std::span<const std::string> arguments, std::ostream& out, std::ostream& err);

}  // namespace clamor
