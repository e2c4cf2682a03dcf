// command_line_fuzz.cpp: command lines with one word per line, and the parsers of single words. No
// file exists, so nothing is baked; words with a slash, sound devices and benchmarks are excluded.
#include <sstream>
#include <vector>

#include "formats/level/emitter_spec.h"
#include "tests/fuzz/fuzz_target.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  (void)parse_emitter(text);
  (void)parse_gain(text);
  (void)parse_listener(std::string(text));
  (void)request_from_note(std::string(text));
  if (text.find('/') != std::string_view::npos) return 0;

  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == '\n')
      words.emplace_back();
    else
      words.back() += c;
  }
  if (words[0] == "devices" || words[0] == "play" || words[0] == "bench") return 0;
  std::ostringstream out, err;
  const int code = run_clamor(words, out, err);
  if (code < 0 || code > 2 || (code != 0 && err.str().empty())) std::abort();
  return 0;
}
