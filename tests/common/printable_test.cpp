#include "common/printable.h"

#include <gtest/gtest.h>

#include "common/name_length.h"
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

TEST(Names, ThatAreLongLoseTheirMiddleBetweenCharacters) {
  std::string name = "wall";
  shorten(name, 4);
  EXPECT_EQ(name, "wall");
  name = "begin----------end";
  shorten(name, 11);
  EXPECT_EQ(name, "begi...-end");
  for (std::size_t most = 7; most < 20; ++most) {  // of two bytes each
    std::string umlauts;
    for (int i = 0; i < 40; ++i) umlauts += "\xc3\xbc";
    shorten(umlauts, most);
    EXPECT_LE(umlauts.size(), most);
    EXPECT_EQ(printable(umlauts), umlauts) << most;
    const std::string once = umlauts;
    shorten(umlauts, most);
    EXPECT_EQ(umlauts, once);  // readers of a file that holds a shortened name change nothing
  }
}

TEST(Printable, IsAppliedToErrorsAndQuotes) {
  const std::string forged = "x\nclamor: all is well\x1b[2J\xc2\x9b";
  EXPECT_EQ(Error("the material " + forged + " is unknown").message,
            "the material x?clamor: all is well?[2J? is unknown");
  EXPECT_EQ(in_quotes(forged), "'x?clamor: all is well?[2J?'");
}

}  // namespace
}  // namespace clamor
