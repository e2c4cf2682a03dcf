#include "tools/view/view_script.h"

#include <cmath>
#include <locale>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "formats/level/level_origin.h"

namespace clamor {

namespace {

using Kind = ViewEvent::Kind;

struct Number {
  const char* name = nullptr;
  double least = 0, most = 0;
  bool is_whole = false;
  std::optional<double> usual{};  // where it is left out
};

struct Form {
  const char* words;  // the first of a line
  Kind kind;
  bool has_text = false;
  std::vector<Number> numbers{};
};

constexpr double kMostPixels = 8192, kMostFrames = 100'000, kMostSeconds = 3600;
constexpr double kMostSteps = 1000;  // of a wheel
const Number kWaitLimit{"number of seconds", 0, kMostSeconds, false, kMostSeconds};
constexpr double kFar_m = kMaxWorldCoordinate_m;

// Longer forms precede those that they begin with.
const std::vector<Form>& forms() {
  static const std::vector<Form> all = {
      {"size",
       Kind::kSize,
       false,
       {{"width", kLeastWindowWidth, kMostPixels, true},
        {"height", kLeastWindowHeight, kMostPixels, true}}},
      {"move world",
       Kind::kMoveWorld,
       false,
       {{"X", -kFar_m, kFar_m}, {"Y", -kFar_m, kFar_m}, {"Z", -kFar_m, kFar_m}}},
      {"move", Kind::kMove, false, {{"X", 0, kMostPixels}, {"Y", 0, kMostPixels}}},
      {"press", Kind::kPress},
      {"release", Kind::kRelease},
      {"click right", Kind::kRightClick},
      {"click", Kind::kClick},
      {"scroll", Kind::kScroll, false, {{"number of steps", -kMostSteps, kMostSteps}}},
      {"type", Kind::kType, true},
      {"drop", Kind::kDrop, true},
      {"wait frames", Kind::kWaitFrames, false, {{"number of frames", 0, kMostFrames, true}}},
      {"wait seconds", Kind::kWaitSeconds, false, {{"number of seconds", 0, kMostSeconds}}},
      {"wait sound", Kind::kWaitSound, false, {kWaitLimit}},
      {"wait quick", Kind::kWaitQuick, false, {kWaitLimit}},
      {"wait final", Kind::kWaitFinal, false, {kWaitLimit}},
      {"wait rebaked", Kind::kWaitRebaked, false, {kWaitLimit}},
      {"screenshot", Kind::kScreenshot, true},
      {"print edit", Kind::kPrint},
      {"print doors", Kind::kPrintDoors},
      {"quit", Kind::kQuit}};
  return all;
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

bool begins_with_words(const std::string& line, const std::string& words) {
  return line == words || line.starts_with(words + " ");
}

Error no_event() {
  return Error(
      "is no event; events are size, move, press, release, click, scroll, key, type, drop, wait, "
      "screenshot, print and quit, as view_script.h describes them");
}

Result<ViewEvent> parse_key(const std::string& rest) {
  ViewEvent event;
  event.kind = Kind::kKey;
  event.text = rest;
  if (rest.ends_with(" down")) {
    event.kind = Kind::kKeyDown;
    event.text = trimmed(rest.substr(0, rest.size() - 5));
  } else if (rest.ends_with(" up")) {
    event.kind = Kind::kKeyUp;
    event.text = trimmed(rest.substr(0, rest.size() - 3));
  }
  if (event.text.empty()) return Error("needs the name of a key, as in 'key W down'");
  return event;
}

Result<double> read_number(const std::string& word, const Number& number) {
  if (word.empty() && number.usual) return *number.usual;
  const auto expected = fmt::format("the {} must be a {}number from {} to {}", number.name,
                                    number.is_whole ? "whole " : "", number.least, number.most);
  std::istringstream in(word);
  in.imbue(std::locale::classic());
  double value = 0;
  if (!(in >> value) || !(in >> std::ws).eof())
    return Error(word.empty() ? "lacks a number: " + expected
                              : fmt::format("has '{}': {}", word, expected));
  if (!(value >= number.least && value <= number.most) ||
      (number.is_whole && value != std::floor(value)))
    return Error(fmt::format("has {}: {}", word, expected));
  return value;
}

// The Error goes on from the line.
Result<ViewEvent> parse_line(const std::string& line) {
  if (begins_with_words(line, "key")) return parse_key(trimmed(line.substr(3)));
  if (line.starts_with("move \"") && line.ends_with("\"") && line.size() > 7) {
    ViewEvent event;
    event.kind = Kind::kMoveTo;
    event.text = line.substr(6, line.size() - 7);
    return event;
  }
  for (const Form& form : forms()) {
    if (!begins_with_words(line, form.words)) continue;
    ViewEvent event;
    event.kind = form.kind;
    const std::string rest = trimmed(line.substr(std::string(form.words).size()));
    if (form.has_text) {
      event.text = rest;
      if (rest.empty()) return Error("lacks what follows the word");
      return event;
    }
    std::istringstream words(rest);
    double* const places[] = {&event.x, &event.y, &event.z};
    for (std::size_t i = 0; i < form.numbers.size(); ++i) {
      std::string word;
      words >> word;
      const auto value = read_number(word, form.numbers[i]);
      if (!value.ok()) return value.error();
      *places[i] = *value;
    }
    std::string more;
    if (words >> more) return Error(fmt::format("has '{}' too many", more));
    return event;
  }
  return no_event();
}

}  // namespace

Result<std::vector<ViewEvent>> parse_view_script(const std::string& text) {
  std::vector<ViewEvent> events;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    auto event = parse_line(line);
    if (!event.ok())
      return Error(fmt::format("line {}: '{}' {}", number, line, event.error().message));
    event->line = number;
    events.push_back(std::move(*event));
  }
  return events;
}

}  // namespace clamor
