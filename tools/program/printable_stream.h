// printable_stream.h: filters terminal control sequences from everything that the program prints.
//
// Everything that a command prints passes printable() here, wherever a name from a file got into
// it. Line ends and tabs pass; names lose theirs when a message or table is composed. The control
// sequences that the program itself needs, for terminal_output.h, are written here past the filter.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>

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

}  // namespace clamor
