// printable.h: text that came from anywhere, as a terminal or a log may show it.
//
// Names in levels and bake files may hold what steers a terminal (escape sequences, also as the
// eighth-bit controls of ISO 6429), what reorders the text around it (bidirectional controls), line
// ends that forge a line of ours, or bytes that are no UTF-8. All of these become a question mark.
// Error and in_quotes() (result.h) pass their text through here, tables pass their cells, and
// PrintableStream (tools) passes all that the program writes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace clamor {

// Whether the text is one line, or has line ends and tabs of ours.
enum class Lines { kOne, kMany };

std::string printable(std::string_view text, Lines lines = Lines::kOne);

// JSON whose strings show nothing of that kind either: what printable() would replace is written as
// an escape that readers turn back. `json` is valid UTF-8, its controls below 32 escaped already.
std::string printable_json(std::string_view json);

// How many bytes at the end are the beginning of a character of UTF-8 whose rest may follow.
std::size_t incomplete_bytes(std::string_view text);

}  // namespace clamor
