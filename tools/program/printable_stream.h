// printable_stream.h: where all that the program writes leaves it, without what would steer a
// terminal.
//
// Whatever a command prints, and however a name from a file got into it, passes printable() here.
// Line ends and tabs pass; names lose theirs where a message or a table takes them in. The few
// controls that the program itself needs have functions of their own, which no text can imitate.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace clamor {

// While it lives, all that is written to the stream is filtered.
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
    // What is left of a character that never ended.
    void finish();

   protected:
    int_type overflow(int_type byte) override;
    std::streamsize xsputn(const char* bytes, std::streamsize count) override;
    int sync() override { return to_->pubsync(); }

   private:
    bool put(std::string_view text);

    std::streambuf* const to_;
    std::string incomplete_;  // beginning of a character
  };

  friend std::ostream& put_control(std::ostream& stream, std::string_view sequence);

  std::ostream& stream_;
  Buffer buffer_;
};

// Back to where the terminal's line begins; and away with what is right of the cursor.
std::ostream& to_line_start(std::ostream& stream);
std::ostream& clear_rest_of_line(std::ostream& stream);

}  // namespace clamor
