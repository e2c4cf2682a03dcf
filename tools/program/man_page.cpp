// man_page.cpp: man pages in the macros of roff.
#include <algorithm>
#include <cctype>
#include <string_view>

#include <fmt/format.h>

#include "common/version.h"
#include "tools/program/command_description.h"

namespace clamor {

namespace {

// Escapes a line, so that roff prints it as it is.
std::string roff(std::string_view line) {
  std::string text;
  if (line.starts_with('.') || line.starts_with('\'')) text = "\\&";
  for (const char c : line) {
    if (c == '\\')
      text += "\\e";
    else if (c == '-')
      text += "\\-";
    else if (c == '\'')
      text += "\\(aq";
    else if (c == '^')
      text += "\\(ha";
    else if (c == '~')
      text += "\\(ti";
    else
      text += c;
  }
  return text;
}

// Paragraphs; lines that begin with blanks keep their breaks.
std::string paragraphs(const std::string& text) {
  std::string page;
  bool verbatim = false, starts = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (verbatim != line.starts_with("  ")) {
      page += verbatim ? ".fi\n" : ".PP\n.nf\n";
      starts = starts && verbatim;
      verbatim = !verbatim;
    }
    if (line.empty()) {
      starts = true;
      continue;
    }
    if (starts) page += ".PP\n";
    starts = false;
    page += roff(line) + "\n";
  }
  return verbatim ? page + ".fi\n" : page;
}

std::string head(const std::string& name, const std::string& summary) {
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format(
      ".TH {} 1 \"\" \"clamor {}\" \"Clamor\"\n.ad l\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n",
      roff(title), kVersion, roff(name), roff(summary));
}

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n0 for success, 1 for bad input, 2 for bad usage.\n";

std::string example(const std::string& line) {
  return ".SH EXAMPLE\n.nf\n" + roff(line) + "\n.fi\n";
}

std::string entry(const OptionDescription& option) {
  std::string text = ".TP\n";
  if (option.names.front().starts_with('-')) {
    for (std::size_t i = 0; i < option.names.size(); ++i)
      text += (i > 0 ? ", " : "") + ("\\fB" + roff(option.names[i]) + "\\fR");
    if (!option.value.empty()) text += " \\fI" + roff(option.value) + "\\fR";
  } else {
    text += "\\fI" + roff(option.names.front()) + "\\fR";
  }
  text += "\n" + roff(option.help);
  if (option.required && option.names.front().starts_with('-')) text += " (required)";
  if (!option.usual.empty()) text += roff(" [" + option.usual + "]");
  return text + "\n";
}

}  // namespace

std::string man_page_name(const CommandDescription& command) {
  std::string name = "clamor-" + command.name;
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string man_page(const CommandDescription& command) {
  std::string page = head(man_page_name(command), command.summary);
  page += fmt::format("\\fBclamor {}\\fR", command.name);
  for (const OptionDescription& option : command.options)
    if (option.required)
      page += fmt::format(" \\fB{}\\fR \\fI{}\\fR", roff(option.names.front()), roff(option.value));
  page += " [\\fIOPTIONS\\fR]";
  for (const OptionDescription& word : command.positionals)
    page += fmt::format(" \\fI{}\\fR{}", roff(word.names.front()), word.repeatable ? "..." : "");
  page += "\n.SH DESCRIPTION\n" + paragraphs(command.purpose);
  if (!command.positionals.empty()) page += ".SH ARGUMENTS\n";
  for (const OptionDescription& word : command.positionals) page += entry(word);
  page += ".SH OPTIONS\n";
  for (const OptionDescription& option : command.options) page += entry(option);
  return page + kExitStatus + example(command.example) + ".SH SEE ALSO\n.BR clamor (1)\n";
}

std::string man_page(std::span<const CommandDescription> commands) {
  std::string page = head("clamor", "bakes the acoustics of a level and plays them back");
  page +=
      "\\fBclamor\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.br\n"
      "\\fBclamor\\fR \\fICOMMAND\\fR \\fB\\-\\-help\\fR\n.br\n"
      "\\fBclamor \\-\\-help\\fR | \\fB\\-\\-version\\fR\n"
      ".SH DESCRIPTION\n"
      "Clamor traces sound through a level once, stores its emitters and reflections in one file, "
      "and plays that file from where a listener stands.\n"
      ".SH COMMANDS\n";
  std::string others;
  for (const CommandDescription& command : commands) {
    if (command.is_subcommand()) continue;
    page += fmt::format(".TP\n\\fBclamor {}\\fR\n{}\n", command.name, roff(command.summary));
    others += fmt::format("{}.BR clamor\\-{} (1)", others.empty() ? "" : ",\n", command.name);
  }
  page += kExitStatus;
  page += example("clamor bake level.glb -o level.clamor && clamor play level.clamor");
  return page + ".SH SEE ALSO\n" + others + "\n";
}

}  // namespace clamor
