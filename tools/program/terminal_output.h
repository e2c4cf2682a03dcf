// terminal_output.h: what output looks like on a terminal: its width, lines that fit it, colours.
//
// A line that is redrawn asks for the width each time, so it fits a window that was resized.
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <string_view>

namespace clamor {

// Whether the stream is standard output or error, and that is a terminal.
bool is_terminal(const std::ostream& stream);

// Columns of the terminal; elsewhere the environment's COLUMNS, or 80.
std::size_t columns_of(const std::ostream& stream);

// Joins the fields, the most important first, and leaves out those that do not fit. A first field
// that does not fit is cut.
std::string fitted(std::span<const std::string> fields, std::size_t columns);

// Shows the fields that fit on a line of a terminal that the next output replaces; elsewhere prints
// a line with all of them.
void show_line(std::ostream& stream, std::span<const std::string> fields);

// Breaks the text at blanks. All lines but the first are indented. Words that are longer than a
// line stay whole.
std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent = 0);

// Colours are shown on terminals (kAuto), unless the environment has NO_COLOR or a dumb terminal.
enum class ColourUse { kAuto, kAlways, kNever };
void use_colours(std::ostream& stream, ColourUse use);

// Prints "warning: TEXT", or "  warning  TEXT" in a list.
void print_warning(std::ostream& stream, std::string_view text);
void print_listed_warning(std::ostream& stream, std::string_view text);

// Prints "clamor COMMAND: MESSAGE".
void print_error(std::ostream& stream, std::string_view command, std::string_view message);

// Prints text in the colour of warnings.
void print_as_warning(std::ostream& stream, std::string_view text);

}  // namespace clamor
