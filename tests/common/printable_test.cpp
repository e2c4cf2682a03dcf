#include "common/printable.h"

#include <gtest/gtest.h>

#include "common/result.h"

namespace clamor {
namespace {

TEST(Printable, KeepsText) {
  for (const std::string text : {"", "violin 2", "Fl\xc3\xbcgel", "\xe5\xa3\xb0",
                                 "\xf0\x9f\x8e\xbb", "\xc2\xa0", "\xe2\x80\xa6", "\xef\xbf\xbd"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ReplacesTerminalAndBidirectionalControls) {
  for (const char* const control :
       {"\x01",         "\a",           "\b",           "\t",           "\n",
        "\r",           "\x1b",         "\x7f",                                      // C0, delete
        "\xc2\x80",     "\xc2\x85",     "\xc2\x9b",     "\xc2\x9d",     "\xc2\x9f",  // C1
        "\xd8\x9c",     "\xe2\x80\x8e", "\xe2\x80\x8f",                              // marks
        "\xe2\x80\xaa", "\xe2\x80\xae", "\xe2\x81\xa6", "\xe2\x81\xa9",              // overrides
        "\xe2\x80\xa8", "\xe2\x80\xa9",                                              // line ends
        "\x80",         "\x9b",         "\x9d",         "\xff",         "\xc3",
        "\xe2",         "\xf0"})  // invalid UTF-8
    EXPECT_EQ(printable(std::string("a") + control + "b"), "a?b") << control;
}

// Invalid encodings of controls that some terminals decode.
TEST(Printable, RejectsInvalidUtf8) {
  EXPECT_EQ(printable("\xc0\x9b"), "??");             // overlong
  EXPECT_EQ(printable("\xe0\x82\x9b"), "???");        // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "???");        // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "????");   // beyond the last code point
  EXPECT_EQ(printable("\xe2\x80\x1b[2J"), "???[2J");  // cut short by an escape
}

TEST(Printable, KeepsLineEndsOnRequest) {
  EXPECT_EQ(printable("a\tb\nc\r\x1b", Lines::kMany), "a\tb\nc??");
}

TEST(Printable, EscapesInJsonWhatItWouldReplace) {
  EXPECT_EQ(printable_json("{\n  \"a\xc3\xbc\": \"\xc2\x9b\xe2\x80\xae\x7f\"\n}"),
            "{\n  \"a\xc3\xbc\": \"\\u009b\\u202e\\u007f\"\n}");
}

TEST(Printable, DetectsIncompleteCharacters) {
  EXPECT_EQ(incomplete_bytes("a"), 0u);
  EXPECT_EQ(incomplete_bytes("\xc3\xbc"), 0u);
  EXPECT_EQ(incomplete_bytes("a\xc3"), 1u);
  EXPECT_EQ(incomplete_bytes("\xf0\x9f\x8e"), 3u);
  EXPECT_EQ(incomplete_bytes("\x80\x80\x80\x80"), 0u);
}

TEST(Printable, IsAppliedToErrorsAndQuotes) {
  const std::string forged = "x\nclamor: all is well\x1b[2J\xc2\x9b";
  EXPECT_EQ(Error("the material " + forged + " is unknown").message,
            "the material x?clamor: all is well?[2J? is unknown");
  EXPECT_EQ(in_quotes(forged), "'x?clamor: all is well?[2J?'");
}

}  // namespace
}  // namespace clamor
