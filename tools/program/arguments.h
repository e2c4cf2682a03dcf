// arguments.h: one way for all subcommands to read their options. CLI11 ends here.
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

namespace clamor {

class Arguments {
 public:
  // `example` is printed last, to be copied.
  Arguments(const std::string& command, const std::string& purpose, const std::string& example);
  ~Arguments();

  // A word without a dash in front, required.
  void positional(const std::string& name, std::string& value, const std::string& help);

  // One or more such words.
  void positional(const std::string& name, std::vector<std::string>& values,
                  const std::string& help);

  void flag(const std::string& name, bool& value, const std::string& help);
  void option(const std::string& name, std::string& value, const std::string& help);
  void option(const std::string& name, std::optional<std::string>& value, const std::string& help);
  void option(const std::string& name, std::vector<std::string>& value, const std::string& help);
  void option(const std::string& name, double& value, const std::string& help);
  void option(const std::string& name, int& value, const std::string& help);
  void option(const std::string& name, std::uint64_t& value, const std::string& help);
  // Anything but a whole number in this range is bad usage, and the complaint names the range.
  struct Range {
    int least, most;
  };
  void option(const std::string& name, int& value, Range range, const std::string& help);
  void required(const std::string& name);

  // Empty when the command may go on; otherwise the exit code, with help or the complaint printed.
  std::optional<int> parse(std::span<const std::string> words, std::ostream& out,
                           std::ostream& err);

  // "clamor inspect: 'problem'" and how to get help, for what only the command can check. Errors
  // are sentences; their full stop is left out, since the line goes on.
  int bad_usage(std::ostream& err, const std::string& problem) const;

 private:
  // What is wrong with the first word that looks like an option and is none; "" if there is none.
  std::string unknown_option() const;

  struct State;
  std::unique_ptr<State> state_;
};

// "X,Y,Z[,YAW[,PITCH]]", metres and degrees, as --listener takes it.
Result<Listener> parse_listener(const std::string& text);

// "500MB" or "2GB" in bytes.
Result<std::uint64_t> parse_bytes(const std::string& text);

}  // namespace clamor
