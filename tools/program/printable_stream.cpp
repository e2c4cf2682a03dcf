#include "tools/program/printable_stream.h"

#include <utility>

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

void PrintableStream::Buffer::erase_line() {
  constexpr std::string_view kErase = "\r\x1b[K";
  if (std::exchange(line_is_shown_, false)) to_->sputn(kErase.data(), kErase.size());
}

void PrintableStream::Buffer::finish() {
  erase_line();
  if (!incomplete_.empty()) to_->sputc('?');
  incomplete_.clear();
}

bool PrintableStream::Buffer::put(std::string_view text) {
  erase_line();
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

void put_control(std::ostream& stream, std::string_view sequence) {
  std::streambuf* to = stream.rdbuf();
  if (auto* const filter = dynamic_cast<PrintableStream::Buffer*>(to)) to = filter->to();
  const auto count = static_cast<std::streamsize>(sequence.size());
  if (to->sputn(sequence.data(), count) != count) stream.setstate(std::ios::badbit);
}

void redraw_line(std::ostream& stream, std::string_view line) {
  auto* const filter = dynamic_cast<PrintableStream::Buffer*>(stream.rdbuf());
  if (filter == nullptr) return;
  filter->line_is_shown_ = true;
  put_control(stream, "\r" + printable(line) + "\x1b[K");
  stream.flush();
}

void erase_line(std::ostream& stream) {
  auto* const filter = dynamic_cast<PrintableStream::Buffer*>(stream.rdbuf());
  if (filter == nullptr) return;
  filter->erase_line();
  stream.flush();
}

}  // namespace clamor
