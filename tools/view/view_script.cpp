#include "tools/view/view_script.h"

#include <locale>
#include <optional>
#include <sstream>

#include <fmt/format.h>

namespace clamor {

namespace {

using Kind = ViewEvent::Kind;

struct Form {
  const char* words;  // the first of a line
  int numbers;
  bool has_text;
  Kind kind;
};

// Longer forms precede those that they begin with.
constexpr Form kForms[] = {{"size", 2, false, Kind::kSize},
                           {"move world", 3, false, Kind::kMoveWorld},
                           {"move", 2, false, Kind::kMove},
                           {"press", 0, false, Kind::kPress},
                           {"release", 0, false, Kind::kRelease},
                           {"click right", 0, false, Kind::kRightClick},
                           {"click", 0, false, Kind::kClick},
                           {"scroll", 1, false, Kind::kScroll},
                           {"type", 0, true, Kind::kType},
                           {"drop", 0, true, Kind::kDrop},
                           {"wait frames", 1, false, Kind::kWaitFrames},
                           {"wait seconds", 1, false, Kind::kWaitSeconds},
                           {"wait sound", 0, false, Kind::kWaitSound},
                           {"wait quick", 0, false, Kind::kWaitQuick},
                           {"wait final", 0, false, Kind::kWaitFinal},
                           {"wait rebaked", 0, false, Kind::kWaitRebaked},
                           {"screenshot", 0, true, Kind::kScreenshot},
                           {"print edit", 0, false, Kind::kPrint},
                           {"quit", 0, false, Kind::kQuit}};

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

bool begins_with_words(const std::string& line, const std::string& words) {
  return line == words || line.starts_with(words + " ");
}

std::optional<ViewEvent> parse_key(const std::string& rest) {
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
  return event.text.empty() ? std::nullopt : std::optional(event);
}

std::optional<ViewEvent> parse_line(const std::string& line) {
  if (begins_with_words(line, "key")) return parse_key(trimmed(line.substr(3)));
  if (line.starts_with("move \"") && line.ends_with("\"") && line.size() > 7) {
    ViewEvent event;
    event.kind = Kind::kMoveTo;
    event.text = line.substr(6, line.size() - 7);
    return event;
  }
  for (const Form& form : kForms) {
    if (!begins_with_words(line, form.words)) continue;
    ViewEvent event;
    event.kind = form.kind;
    const std::string rest = trimmed(line.substr(std::string(form.words).size()));
    if (form.has_text) {
      event.text = rest;
      return rest.empty() ? std::nullopt : std::optional(event);
    }
    std::istringstream numbers(rest);
    numbers.imbue(std::locale::classic());
    double* const places[] = {&event.x, &event.y, &event.z};
    for (int i = 0; i < form.numbers; ++i)
      if (!(numbers >> *places[i])) return std::nullopt;
    std::string more;
    if (numbers >> more) return std::nullopt;
    return event;
  }
  return std::nullopt;
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
    if (!event)
      return Error(fmt::format(
          "line {}: '{}' is no event; events are size, move, press, release, click, scroll, key, "
          "type, drop, wait, screenshot, print and quit, as view_script.h describes them",
          number, line));
    event->line = number;
    events.push_back(std::move(*event));
  }
  return events;
}

}  // namespace clamor
