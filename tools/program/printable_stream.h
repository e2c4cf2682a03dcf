// printable_stream.h: filters terminal control sequences from everything that the program prints.
//
// Everything that a command prints passes printable() here, wherever a name from a file got into
// it. Line ends and tabs pass; names lose theirs when a message or table is composed. The few
// control sequences that the program itself needs have functions of their own.
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
    bool put(std::string_view text);

    std::streambuf* const to_;
    std::string incomplete_;  // beginning of a UTF-8 character
  };

  friend std::ostream& put_control(std::ostream& stream, std::string_view sequence);

  std::ostream& stream_;
  Buffer buffer_;
};

// Moves the cursor to the start of the line; clears the line to the right of the cursor.
std::ostream& to_line_start(std::ostream& stream);
std::ostream& clear_rest_of_line(std::ostream& stream);

}  // namespace clamor
