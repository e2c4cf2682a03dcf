#include "tools/program/arguments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <map>
#include <numbers>
#include <ostream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/text.h"
#include "tools/program/exit_codes.h"
#include "tools/program/terminal_output.h"

namespace clamor {

struct Arguments::State {
  std::string command, example;
  ColourUse colours = ColourUse::kAuto;
  CLI::App app;
  std::map<std::string, std::vector<std::string>> words;  // by CLI11's name of the option
  std::deque<std::string> texts;                          // that are interpreted later
  std::vector<std::function<Result<void>()>> interpreters;
};

namespace {

std::optional<double> number(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

// CLI11's error about words that make no command, as a sentence about an option or a word.
std::string described(const CLI::ParseError& error, const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() == 1 && option->count() > 1)
      return option->get_name() + " is given " + std::to_string(option->count()) +
             " times; give it once";
  const std::string text = error.what();
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr)
    return text.substr(0, text.find(':')) + " needs a value";
  if (const auto words = app.remaining(); !words.empty())
    return in_quotes(words.front()) + " is one word too many";
  return text;
}

}  // namespace

Arguments::Arguments(const std::string& command, const std::string& purpose,
                     const std::string& example)
    : state_(std::make_unique<State>()) {
  state_->command = command;
  state_->example = example;
  state_->app.description(purpose);
  state_->app.set_help_flag("-h,--help", "print this help");
  state_->app.allow_windows_style_options(false);  // /path/to/file is a file there, too
  choice("--color", state_->colours,
         {{"auto", ColourUse::kAuto}, {"always", ColourUse::kAlways}, {"never", ColourUse::kNever}},
         "colours of warnings and errors: auto (on terminals, unless NO_COLOR is set), always or "
         "never");
}

Arguments::~Arguments() = default;

template <class T>
void Arguments::positional(const std::string& name, T& value, const std::string& help) {
  state_->app.add_option(name, value, help)->required();
}
template void Arguments::positional(const std::string&, std::string&, const std::string&);
template void Arguments::positional(const std::string&, std::vector<std::string>&,
                                    const std::string&);

void Arguments::flag(const std::string& name, bool& value, const std::string& help) {
  state_->app.add_flag(name, value, help);
}

template <class T>
void Arguments::option(const std::string& name, T& value, const std::string& help) {
  CLI::Option* const option = state_->app.add_option(name, value, help);
  if constexpr (std::is_same_v<T, std::vector<std::string>>)
    option->expected(1)
        ->allow_extra_args(false)  // the next word belongs to something else
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>)
    option->capture_default_str();
  if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::optional<double>>)
    option->check([](const std::string& word) {
      return number(word) ? "" : in_quotes(word) + " is not a number";
    });
}
template void Arguments::option(const std::string&, std::string&, const std::string&);
template void Arguments::option(const std::string&, std::optional<std::string>&,
                                const std::string&);
template void Arguments::option(const std::string&, std::vector<std::string>&, const std::string&);
template void Arguments::option(const std::string&, double&, const std::string&);
template void Arguments::option(const std::string&, std::optional<double>&, const std::string&);
template void Arguments::option(const std::string&, int&, const std::string&);
template void Arguments::option(const std::string&, std::uint64_t&, const std::string&);

template <class T>
void Arguments::option(const std::string& name, T& value, Range range, const std::string& help) {
  const auto check = [range](const std::string& text) -> std::string {
    int number = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, problem] = std::from_chars(text.data(), end, number);
    if (problem == std::errc() && rest == end && number >= range.min && number <= range.max)
      return "";
    return fmt::format("{} is not a whole number between {} and {}", in_quotes(text), range.min,
                       range.max);
  };
  option(name, value, help);
  state_->app.get_option(name)->type_name("INT")->check(check);
}
template void Arguments::option(const std::string&, int&, Range, const std::string&);
template void Arguments::option(const std::string&, std::uint32_t&, Range, const std::string&);
template void Arguments::option(const std::string&, std::size_t&, Range, const std::string&);

void Arguments::text(const std::string& name, const std::string& usual, const std::string& help,
                     std::function<Result<void>(const std::string&)> read) {
  std::string& word = state_->texts.emplace_back(usual);
  option(name, word, help);
  then([this, name, &word, read = std::move(read)] {
    return given(name) ? read(word) : Result<void>();
  });
}

void Arguments::choice(const std::string& name, const std::string& usual,
                       const std::vector<std::string>& words, const std::string& help,
                       std::function<void(std::size_t)> choose) {
  const auto read = [name, words, choose = std::move(choose)](const std::string& word) {
    const auto found = std::ranges::find(words, word);
    if (found != words.end()) {
      choose(static_cast<std::size_t>(found - words.begin()));
      return Result<void>();
    }
    const auto but_last = std::span(words).first(words.size() - 1);
    return Result<void>(
        Error(fmt::format("{} must be {} or {}, not {}", name, fmt::join(but_last, ", "),
                          words.back(), in_quotes(word))));
  };
  text(name, usual, help, read);
  this->words(name, words);
}

void Arguments::bytes(const std::string& name, std::uint64_t& value, const std::string& help) {
  text(name, "", help, [name, &value](const std::string& word) -> Result<void> {
    const auto bytes = parse_bytes(word);
    if (!bytes.ok()) return Error(name + " " + bytes.error().message);
    value = *bytes;
    return {};
  });
}

void Arguments::listener(const std::string& name, std::optional<Listener>& value,
                         const std::string& help) {
  text(name, "", help, [name, &value](const std::string& word) -> Result<void> {
    if (word.empty()) return {};
    const auto read = parse_listener(word);
    if (!read.ok()) return name == "--listener" ? read.error() : read.error().in(name);
    value = *read;
    return {};
  });
}

void Arguments::then(std::function<Result<void>()> interpret) {
  state_->interpreters.push_back(std::move(interpret));
}

Error Arguments::outside(const std::string& name, double low, double high) {
  return Error(fmt::format("{} must lie between {} and {}", name, low, high));
}

void Arguments::required(const std::string& name) { state_->app.get_option(name)->required(); }
void Arguments::words(const std::string& name, std::vector<std::string> words) {
  state_->words[state_->app.get_option(name)->get_name()] = std::move(words);
}

CommandDescription Arguments::description() const {
  CommandDescription command;
  command.name = state_->command;
  command.purpose = state_->app.get_description();
  command.example = state_->example;
  for (const CLI::Option* option : state_->app.get_options()) {
    OptionDescription described;
    for (const std::string& name : option->get_snames()) described.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) described.names.push_back("--" + name);
    if (option->get_items_expected_max() > 0) described.value = option->get_type_name();
    if (!option->get_required()) described.usual = option->get_default_str();
    described.help = option->get_description();
    if (const auto found = state_->words.find(option->get_name()); found != state_->words.end())
      described.words = found->second;
    described.required = option->get_required();
    described.repeatable = option->get_items_expected_max() > 1;
    if (described.names.empty()) {
      described.names.push_back(option->get_name(true));
      command.positionals.push_back(std::move(described));
    } else {
      command.options.push_back(std::move(described));
    }
  }
  return command;
}

namespace {

// "--listener 3 1.7 2 is X,Y,Z with commas: ..." if an option is followed by three numbers; or "".
std::string numbers_without_commas(std::span<const std::string> words) {
  for (std::size_t i = 0; i + 3 < words.size(); ++i) {
    if (!words[i].starts_with("--") || words[i].find('=') != std::string::npos) continue;
    std::string joined;
    std::size_t count = 0;
    for (; i + 1 + count < words.size() && number(words[i + 1 + count]); ++count)
      joined += (count > 0 ? "," : "") + words[i + 1 + count];
    if (count >= 3)
      return words[i] + " takes numbers with commas between them, not blanks: " + words[i] + " " +
             joined;
  }
  return "";
}

}  // namespace

std::optional<int> Arguments::parse(std::span<const std::string> words, std::ostream& out,
                                    std::ostream& err) {
  if (auto* const described = dynamic_cast<DescriptionStream*>(&out)) {
    described->description = description();
    return kSuccess;
  }
  try {
    state_->app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    Result<void> interpreted;
    for (const auto& interpret : state_->interpreters)
      if (interpreted.ok()) interpreted = interpret();
    for (std::ostream* const stream : {&out, &err}) use_colours(*stream, state_->colours);
    if (interpreted.ok()) return std::nullopt;
    return bad_usage(err, interpreted.error().message);
  } catch (const CLI::CallForHelp&) {
    out << help_text(description(), columns_of(out));
    return kSuccess;
  } catch (const CLI::ParseError& error) {
    // Blanks in a position and a misspelled option are reported first: they can be the reason that
    // an option is missing or that a word is left over.
    for (const std::string& reason : {numbers_without_commas(words), unknown_option()})
      if (!reason.empty()) return bad_usage(err, reason);
    return bad_usage(err, described(error, state_->app));
  }
}

bool Arguments::given(const std::string& name) const {
  return state_->app.get_option(name)->count() > 0;
}

std::string Arguments::unknown_option() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : state_->app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const std::string& word : state_->app.remaining()) {
    if (!word.starts_with("--") || word.size() < 3) continue;
    const std::string option = word.substr(0, word.find('='));
    return "there is no option " + in_quotes(option) + "; the nearest is " +
           in_quotes(nearest_name(option, names));
  }
  return "";
}

int Arguments::bad_usage(std::ostream& err, const std::string& problem) const {
  const std::string shown = printable(problem);
  std::string_view clause = shown;
  if (clause.ends_with('.')) clause.remove_suffix(1);
  print_error(err, state_->command,
              fmt::format("{}; see 'clamor {} --help'", clause, state_->command));
  return kBadUsage;
}

int Arguments::end(std::ostream& err, const Result<void>& done) const {
  if (done.ok()) return kSuccess;
  print_error(err, state_->command, done.error().message);
  return kBadInput;
}

Result<Listener> parse_listener(const std::string& text) {
  const Error wrong("listener " + in_quotes(text) +
                    " is not X,Y,Z or X,Y,Z,YAW or X,Y,Z,YAW,PITCH (metres, degrees, up to 1e9), "
                    "as in 0,1.7,3,90");
  std::vector<double> values;
  std::string_view rest = text;
  while (true) {
    const auto comma = rest.find(',');
    const auto value = number(rest.substr(0, comma));
    if (!value || std::abs(*value) > 1e9) return wrong;
    values.push_back(*value);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (values.size() < 3 || values.size() > 5) return wrong;
  values.resize(5, 0.0);
  constexpr double kRadians = std::numbers::pi / 180;
  return Listener{{values[0], values[1], values[2]}, values[3] * kRadians, values[4] * kRadians};
}

Result<std::uint64_t> parse_bytes(const std::string& text) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [unit, wrong] = std::from_chars(text.data(), end, number);
  const std::string_view suffix(unit, static_cast<std::size_t>(end - unit));
  if (wrong == std::errc() && number > 0 && number <= 1'000'000) {
    if (equal_ignoring_case(suffix, "MB")) return number * 1'000'000;
    if (equal_ignoring_case(suffix, "GB")) return number * 1'000'000'000;
  }
  return Error(in_quotes(text) + " is not a size like 500MB or 2GB");
}

}  // namespace clamor
