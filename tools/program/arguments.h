// arguments.h: command-line options of all subcommands. Only arguments.cpp includes CLI11.
//
//   Arguments arguments("inspect", "Prints what a bake file holds.", "clamor inspect hall.clamor");
//   arguments.positional("file", path, "the bake file");
//   arguments.flag("--json", json, "...");
//   if (const auto code = arguments.parse(words, out, err)) return *code;
#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/listener.h"
#include "common/result.h"
#include "tools/program/command_description.h"

namespace clamor {

class Arguments {
 public:
  // `example` is the last line of --help.
  Arguments(const std::string& command, const std::string& purpose, const std::string& example);
  ~Arguments();

  // A required word without a leading dash.
  void positional(const std::string& name, std::string& value, const std::string& help);

  // One or more required words.
  void positional(const std::string& name, std::vector<std::string>& values,
                  const std::string& help);

  void flag(const std::string& name, bool& value, const std::string& help);
  void option(const std::string& name, std::string& value, const std::string& help);
  void option(const std::string& name, std::optional<std::string>& value, const std::string& help);
  void option(const std::string& name, std::vector<std::string>& value, const std::string& help);
  void option(const std::string& name, double& value, const std::string& help);
  void option(const std::string& name, std::optional<double>& value, const std::string& help);
  void option(const std::string& name, int& value, const std::string& help);
  void option(const std::string& name, std::uint64_t& value, const std::string& help);
  // Anything but a whole number in this range is bad usage, and the message names the range.
  struct Range {
    int min, max;
  };
  void option(const std::string& name, int& value, Range range, const std::string& help);
  void required(const std::string& name);

  // Words that shells offer as the value of an option or positional. They forbid no others.
  void words(const std::string& name, std::vector<std::string> words);

  // Returns nothing if the command may go on; otherwise the exit code, after printing help or the
  // error. A DescriptionStream as `out` gets the description, and the command may not go on.
  std::optional<int> parse(std::span<const std::string> words, std::ostream& out,
                           std::ostream& err);

  // Whether an option is on the command line. Call after parse().
  bool given(const std::string& name) const;

  // Prints "clamor inspect: PROBLEM; see 'clamor inspect --help'" and returns kBadUsage, for errors
  // that only the command can find. A final full stop of the problem is left out.
  int bad_usage(std::ostream& err, const std::string& problem) const;

 private:
  // Error text for the first word that looks like an option but is none; "" if there is none.
  std::string unknown_option() const;

  CommandDescription description() const;

  struct State;
  std::unique_ptr<State> state_;
};

// Parses "X,Y,Z[,YAW[,PITCH]]" in metres and degrees.
Result<Listener> parse_listener(const std::string& text);

// Parses "500MB" or "2GB" to bytes.
Result<std::uint64_t> parse_bytes(const std::string& text);

}  // namespace clamor
