#include "tools/program/terminal_output.h"

#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "tools/program/progress.h"

namespace clamor {
namespace {

TEST(Fitted, LeavesOutWhatDoesNotFitAndKeepsTheMostImportant) {
  const std::vector<std::string> fields = {"tracing", "", "3 s left", "many bounces", "1 %"};
  EXPECT_EQ(fitted(fields, 100), "tracing  3 s left  many bounces  1 %");
  EXPECT_EQ(fitted(fields, 36), "tracing  3 s left  many bounces  1 %");
  EXPECT_EQ(fitted(fields, 35), "tracing  3 s left  many bounces");
  EXPECT_EQ(fitted(fields, 30), "tracing  3 s left  1 %");
  EXPECT_EQ(fitted(fields, 5), "traci");
  EXPECT_EQ(fitted(fields, 0), "");
}

TEST(Wrapped, BreaksAtBlanksAndIndentsWhatFollows) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("one two three", 9, 2), "one two\n  three");
  EXPECT_EQ(wrapped("incomprehensibilities are whole", 9), "incomprehensibilities\nare whole");
  EXPECT_EQ(wrapped("", 9), "");
}

TEST(RedrawnLine, IsReplacedByWhatIsPrintedNext) {
  std::ostringstream text;
  {
    PrintableStream filter(text);
    redraw_line(text, "10 %\n\x1b[2J");  // a name steers no terminal here, either
    redraw_line(text, "20 %");
    text << "warning\n";
    redraw_line(text, "30 %");
  }
  EXPECT_EQ(text.str(), "\r10 %??[2J\x1b[K\r20 %\x1b[K\r\x1b[Kwarning\n\r30 %\x1b[K\r\x1b[K");
}

TEST(TimeLeft, DoesNotCountWhatCameBeforeTheWork) {
  // Five seconds of preparation, then a hundredth of the work in 0.3 s.
  TimeLeft left;
  std::optional<double> first;
  double share = 0;
  for (double now_s = 5; !first; now_s += 0.3, share += 0.01) first = left.seconds(share, now_s);
  EXPECT_NEAR(*first, 30 * (1 - share), 0.5);
}

TEST(TimeLeft, FollowsTheRateOfTheLastSeconds) {
  // Half of the work comes from a journal, in a second.
  TimeLeft left;
  for (int i = 0; i <= 10; ++i) left.seconds(0.05 * i, 0.1 * i);
  double now_s = 1, share = 0.5;
  for (; now_s < 21; now_s += 0.1) left.seconds(share += 0.001, now_s);
  EXPECT_NEAR(*left.seconds(share, now_s), (1 - share) / 0.01, 1);
}

TEST(TimeLeft, IsUnknownAtFirst) {
  TimeLeft left;
  EXPECT_FALSE(left.seconds(0, 0).has_value());
  EXPECT_FALSE(left.seconds(0.5, 0.5).has_value());  // too early
  EXPECT_FALSE(left.seconds(0.5, 0).has_value());
}

}  // namespace
}  // namespace clamor
