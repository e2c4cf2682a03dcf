// arguments.h: command-line options of all subcommands. Only arguments.cpp includes CLI11.
//
//   Arguments arguments("inspect", "Prints what a bake file holds.", "clamor inspect hall.clamor");
//   arguments.positional("file", path, "the bake file");
//   arguments.flag("--json", json, "...");
//   if (const auto code = arguments.parse(words, out, err)) return *code;
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
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

  // A required word without a leading dash, or a list of one or more.
  template <class T>
  void positional(const std::string& name, T& value, const std::string& help);

  void flag(const std::string& name, bool& value, const std::string& help);

  // T is text or a number, either of them unset by default, or a list of texts for an option that
  // may be repeated.
  template <class T>
  void option(const std::string& name, T& value, const std::string& help);
  // Anything but a whole number in this range is bad usage, and the message names the range.
  struct Range {
    int min, max;
  };
  template <class T>
  void option(const std::string& name, T& value, Range range, const std::string& help);
  void required(const std::string& name);

  // One of these words, which shells offer; any other is bad usage. `value` is the default.
  template <class T>
  void choice(const std::string& name, T& value,
              const std::vector<std::pair<std::string, std::type_identity_t<T>>>& words,
              const std::string& help) {
    std::vector<std::string> names;
    std::string usual;
    for (const auto& [word, meaning] : words) {
      names.push_back(word);
      if (meaning == value) usual = word;
    }
    choice(name, usual, names, help, [&value, words](std::size_t i) { value = words[i].second; });
  }

  // Values are read by parse_bytes() and parse_listener(). An empty listener counts as none.
  void bytes(const std::string& name, std::uint64_t& value, const std::string& help);
  void listener(const std::string& name, std::optional<Listener>& value, const std::string& help);

  // Interprets options once all words are parsed, in the order of these calls. An Error is bad
  // usage.
  void then(std::function<Result<void>()> interpret);

  // A value of this option outside these bounds is bad usage.
  template <class T>
  void within(const std::string& name, const T& value, double low, double high) {
    then([name, &value, low, high] {
      const auto given = static_cast<double>(value);
      return given >= low && given <= high ? Result<void>() : outside(name, low, high);
    });
  }

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

  // Prints an Error as "clamor inspect: PROBLEM". Returns the exit code.
  int end(std::ostream& err, const Result<void>& done) const;

 private:
  // Error text for the first word that looks like an option but is none; "" if there is none.
  std::string unknown_option() const;

  CommandDescription description() const;
  void choice(const std::string& name, const std::string& usual,
              const std::vector<std::string>& words, const std::string& help,
              std::function<void(std::size_t)> choose);
  void text(const std::string& name, const std::string& usual, const std::string& help,
            std::function<Result<void>(const std::string&)> read);
  static Error outside(const std::string& name, double low, double high);

  struct State;
  std::unique_ptr<State> state_;
};

// Parses "X,Y,Z[,YAW[,PITCH]]" in metres and degrees.
Result<Listener> parse_listener(const std::string& text);

// Parses "500MB" or "2GB" to bytes.
Result<std::uint64_t> parse_bytes(const std::string& text);

}  // namespace clamor
