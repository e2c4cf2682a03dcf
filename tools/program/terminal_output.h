// terminal_output.h: what output looks like on a terminal: its width, lines that fit it, colours;
// and the filter that keeps control sequences of others from it.
//
// A line that is redrawn asks for the width each time, so it fits a window that was resized.
//
// Everything that a command prints passes printable() here, wherever a name from a file got into
// it. Line ends and tabs pass; names lose theirs when a message or table is composed. The control
// sequences that the program itself needs are written past the filter.
#pragma once

#include <ostream>
#include <span>
#include <streambuf>
#include <string>
#include <string_view>

namespace clamor {

// Filters everything written to the stream during its lifetime.
class PrintableStream {
 public:
  explicit PrintableStream(std::ostream& stream);
  ~PrintableStream();
  PrintableStream(const PrintableStream&) = delete;
  PrintableStream& operator=(const PrintableStream&) = delete;

 private:
  class Buffer : public std::streambuf {
   public:
    explicit Buffer(std::streambuf* to) : to_(to) {}
    std::streambuf* to() const { return to_; }
    // Writes what is left of an incomplete character.
    void finish();

   protected:
    int_type overflow(int_type byte) override;
    std::streamsize xsputn(const char* bytes, std::streamsize count) override;
    int sync() override { return to_->pubsync(); }

   private:
    friend void redraw_line(std::ostream& stream, std::string_view line);
    friend void erase_line(std::ostream& stream);

    bool put(std::string_view text);
    void erase_line();

    std::streambuf* const to_;
    std::string incomplete_;      // beginning of a UTF-8 character
    bool line_is_shown_ = false;  // by redraw_line()
  };

  friend void redraw_line(std::ostream& stream, std::string_view line);
  friend void erase_line(std::ostream& stream);
  friend void put_control(std::ostream& stream, std::string_view sequence);

  std::ostream& stream_;
  Buffer buffer_;
};

// Shows a line on a terminal that the next output, or the next such line, replaces. The stream must
// be filtered.
void redraw_line(std::ostream& stream, std::string_view line);
void erase_line(std::ostream& stream);

// Writes a control sequence past the filter.
void put_control(std::ostream& stream, std::string_view sequence);

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
