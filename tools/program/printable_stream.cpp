#include "tools/program/printable_stream.h"

#include "common/printable.h"

namespace clamor {

PrintableStream::PrintableStream(std::ostream& stream) : stream_(stream), buffer_(stream.rdbuf()) {
  const auto state = stream.rdstate();  // rdbuf() clears it
  stream.rdbuf(&buffer_);
  stream.setstate(state);
}

PrintableStream::~PrintableStream() {
  const auto state = stream_.rdstate();
  buffer_.finish();
  stream_.rdbuf(buffer_.to());
  stream_.setstate(state);
}

void PrintableStream::Buffer::finish() {
  if (!incomplete_.empty()) to_->sputc('?');
  incomplete_.clear();
}

bool PrintableStream::Buffer::put(std::string_view text) {
  const std::string shown = printable(text, Lines::kMany);
  const auto count = static_cast<std::streamsize>(shown.size());
  return to_->sputn(shown.data(), count) == count;
}

std::streamsize PrintableStream::Buffer::xsputn(const char* bytes, std::streamsize count) {
  std::string text = std::move(incomplete_);
  text.append(bytes, static_cast<std::size_t>(count));
  const std::size_t whole = text.size() - incomplete_bytes(text);
  incomplete_ = text.substr(whole);
  return put(std::string_view(text).substr(0, whole)) ? count : 0;
}

PrintableStream::Buffer::int_type PrintableStream::Buffer::overflow(int_type byte) {
  if (traits_type::eq_int_type(byte, traits_type::eof())) return traits_type::not_eof(byte);
  const char one = traits_type::to_char_type(byte);
  return xsputn(&one, 1) == 1 ? byte : traits_type::eof();
}

std::ostream& put_control(std::ostream& stream, std::string_view sequence) {
  stream.flush();
  std::streambuf* to = stream.rdbuf();
  if (auto* const filter = dynamic_cast<PrintableStream::Buffer*>(to)) to = filter->to();
  const auto count = static_cast<std::streamsize>(sequence.size());
  if (to->sputn(sequence.data(), count) != count) stream.setstate(std::ios::badbit);
  return stream;
}

std::ostream& to_line_start(std::ostream& stream) { return put_control(stream, "\r"); }
std::ostream& clear_rest_of_line(std::ostream& stream) { return put_control(stream, "\x1b[K"); }

}  // namespace clamor
