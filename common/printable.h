// printable.h: makes untrusted text safe for terminals and logs.
//
// Names in levels and bake files may contain terminal escape sequences (also as 8-bit controls of
// ISO 6429), bidirectional controls, line ends that forge a line of output, or invalid UTF-8. Each
// becomes a question mark. Error and in_quotes() (result.h), the cells of tables, and
// PrintableStream (tools), through which the program writes, all filter their text here.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace clamor {

// kOne replaces line ends and tabs, kMany keeps them.
enum class Lines { kOne, kMany };

std::string printable(std::string_view text, Lines lines = Lines::kOne);

// Escapes in JSON strings what printable() would replace, so that parsers still see the original.
// `json` is valid UTF-8 with controls below 32 escaped already.
std::string printable_json(std::string_view json);

// Number of bytes at the end that begin an incomplete UTF-8 character.
std::size_t incomplete_bytes(std::string_view text);

}  // namespace clamor
