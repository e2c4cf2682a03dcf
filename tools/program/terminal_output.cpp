#include "tools/program/terminal_output.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iostream>
#include <string>
#include <utility>

#include "common/platform/terminal.h"
#include "common/printable.h"

namespace clamor {

namespace {

constexpr std::size_t kUsualColumns = 80;
constexpr std::string_view kYellow = "\x1b[1;33m", kRed = "\x1b[1;31m", kPlain = "\x1b[0m";

int descriptor_of(const std::ostream& stream) {
  if (&stream == &std::cerr) return 2;
  return &stream == &std::cout ? 1 : -1;
}

std::string_view environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

// Where a stream keeps its ColourUse.
long& colour_use(std::ostream& stream) {
  static const int index = std::ios_base::xalloc();
  return stream.iword(index);
}

bool shows_colours(std::ostream& stream) {
  switch (static_cast<ColourUse>(colour_use(stream))) {
    case ColourUse::kAlways:
      return true;
    case ColourUse::kNever:
      return false;
    case ColourUse::kAuto:
      break;
  }
  return is_terminal(stream) && environment("NO_COLOR").empty() && environment("TERM") != "dumb";
}

void print_coloured(std::ostream& stream, std::string_view colour, std::string_view text) {
  const bool shows = shows_colours(stream);
  if (shows) {
    erase_line(stream);
    put_control(stream, colour);
  }
  stream << text;
  if (shows) put_control(stream, kPlain);
}

}  // namespace

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

bool is_terminal(const std::ostream& stream) {
  const int descriptor = descriptor_of(stream);
  return descriptor >= 0 && is_terminal(descriptor);
}

std::size_t columns_of(const std::ostream& stream) {
  if (is_terminal(stream))
    if (const std::size_t columns = terminal_columns(descriptor_of(stream)); columns > 0)
      return columns;
  const std::string_view text = environment("COLUMNS");
  std::size_t columns = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), columns);
  return wrong == std::errc() && columns > 0 ? columns : kUsualColumns;
}

std::string fitted(std::span<const std::string> fields, std::size_t columns) {
  std::string line;
  for (const std::string& field : fields) {
    if (field.empty()) continue;
    if (line.empty())
      line = field.substr(0, columns);
    else if (line.size() + 2 + field.size() <= columns)
      line += "  " + field;
  }
  return line;
}

void show_line(std::ostream& stream, std::span<const std::string> fields) {
  // A character in the last column makes some terminals go to the next line.
  if (is_terminal(stream)) return redraw_line(stream, fitted(fields, columns_of(stream) - 1));
  stream << fitted(fields, std::string::npos / 2) << '\n' << std::flush;
}

std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent) {
  std::string out;
  std::size_t column = 0;  // from the indent on
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view word = text.substr(at, text.find(' ', at) - at);
    at += word.size() + 1;
    if (column > 0 && indent + column + 1 + word.size() > columns) {
      out += '\n' + std::string(indent, ' ');
      column = 0;
    } else if (column > 0) {
      out += ' ';
      ++column;
    }
    out += word;
    column += word.size();
  }
  return out;
}

void use_colours(std::ostream& stream, ColourUse use) {
  colour_use(stream) = static_cast<long>(use);
}

void print_warning(std::ostream& stream, std::string_view text) {
  print_coloured(stream, kYellow, "warning:");
  stream << ' ' << text << '\n';
}

void print_listed_warning(std::ostream& stream, std::string_view text) {
  print_coloured(stream, kYellow, "  warning");
  stream << "  " << printable(text) << '\n';
}

void print_error(std::ostream& stream, std::string_view command, std::string_view message) {
  print_coloured(stream, kRed, "clamor " + std::string(command) + ":");
  stream << ' ' << message << '\n';
}

void print_as_warning(std::ostream& stream, std::string_view text) {
  print_coloured(stream, kYellow, text);
}

}  // namespace clamor
