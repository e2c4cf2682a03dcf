// Tests merging shards, and the command that a bake file names.
#include <sys/stat.h>

#include "bake/journal/journal_file.h"
#include "bake/journal/trace_journal.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using testing::read;
using testing::violin_room;

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<std::string> bake_words(const std::string& output) {
  return {"bake",
          violin_room(),
          "-o",
          output,
          "--quiet",
          "--photons",
          "7000",
          "--sources",
          "5000",
          "--seed",
          "3",
          "--emitter",
          "name=drum kit,signal=impulse,at=-1,1,2"};
}

// A text as a journal stores it, and the note of a shard.
std::string record_text(const std::string& text) {
  const auto record = JournalFile::record_of(0, std::as_bytes(std::span(text)));
  return {reinterpret_cast<const char*>(record.data()), record.size()};
}
std::string whole_note(const std::string& path) {
  const auto summary = JournalSummary::of(path);
  return summary.ok() && summary->note ? summary->note->text() : "";
}

TEST(Shards, MergeInAnyOrderToTheBytesOfTheWholeBake_NoAsan) {
  const Folder folder;
  ASSERT_EQ(clamor(with(bake_words(folder / "whole.clamor"), {"--no-journal"})).code, 0);
  const std::string whole = read(folder / "whole.clamor");
  for (const int count : {1, 4}) {
    if (testing::kSanitized && count == 1) continue;  // slow
    std::vector<std::string> merge{"merge", "-o", folder / "merged.clamor", "--quiet"};
    for (int i = count; i > 0; --i) {
      const std::string shard = folder / (std::to_string(i) + ".shard");
      const auto made = clamor(
          with(bake_words(shard), {"--shard", std::to_string(i) + "/" + std::to_string(count)}));
      ASSERT_EQ(made.code, 0) << made.err;
      merge.insert(merge.begin() + (i % 2 == 0 ? 1 : static_cast<long>(merge.size())), shard);
    }
    const auto merged = clamor(merge);
    ASSERT_EQ(merged.code, 0) << merged.err;
    EXPECT_TRUE(read(folder / "merged.clamor") == whole) << count << " shards";
  }
}

TEST(Shards, MissingForeignAndDamagedOnesGetASentenceAndNoOutput_NoAsan) {
  const Folder folder;
  for (const std::string i : {"1", "2"})
    ASSERT_EQ(clamor(with(bake_words(folder / (i + ".shard")), {"--shard", i + "/2"})).code, 0);
  auto other = bake_words(folder / "other.shard");
  other[10] = "4";  // the seed
  ASSERT_EQ(clamor(with(other, {"--shard", "2/2"})).code, 0);
  folder.write("text", "not a shard");
  std::string cut = read(folder / "2.shard");
  folder.write("cut", cut.substr(0, cut.size() / 2));
  cut[cut.size() / 2] = static_cast<char>(cut[cut.size() / 2] ^ 4);
  folder.write("flipped", cut);

  const auto expect_refused = [&](const std::vector<std::string>& shards, const std::string& word) {
    std::vector<std::string> words{"merge", "-o", folder / "out.clamor", "--quiet"};
    for (const std::string& shard : shards) words.push_back(folder / shard);
    const auto outcome = clamor(words);
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out.clamor"));
  };
  expect_refused({"1.shard"}, "none of the shards");
  expect_refused({"1.shard", "other.shard"}, "other options");
  expect_refused({"1.shard", "text"}, "no traced photons");
  expect_refused({"1.shard", "cut"}, "none of the shards");
  expect_refused({"1.shard", "flipped"}, "none of the shards");
  expect_refused({"1.shard", "gone"}, "cannot be read");
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "3/2"})).code, 2);
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "0/2"})).code, 2);
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "1of2"})).code, 2);
}

// The sentence that refuses to merge these shards.
std::string refusal(const Folder& folder, const std::vector<std::string>& shards,
                    const std::vector<std::string>& more = {}) {
  const std::string output = folder / (more.empty() ? "out.clamor" : "out.shard");
  std::vector<std::string> words{"merge", "-o", output, "--quiet"};
  for (const std::string& shard : shards) words.push_back(folder / shard);
  const auto outcome = clamor(with(words, more));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_FALSE(std::filesystem::exists(output));
  return outcome.err;
}

TEST(Shards, ThatAreDamagedStaleMissingOrOfAnotherVersionAreNamed_NoAsan) {
  const Folder folder;
  for (const std::string i : {"1", "2"})
    ASSERT_EQ(clamor(with(bake_words(folder / (i + ".shard")), {"--shard", i + "/3"})).code, 0);
  const std::string whole = read(folder / "2.shard");
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 4);
  const auto expect_named = [&](const std::string& bytes, const std::string& why) {
    folder.write("2.shard", bytes);
    const std::string said = refusal(folder, {"1.shard", "2.shard"}, {"--to-shard"});
    EXPECT_NE(said.find(folder / "2.shard: "), std::string::npos) << said;
    EXPECT_NE(said.find(why), std::string::npos) << said;
  };
  expect_named(flipped, "fails its checksum");
  expect_named(whole.substr(0, whole.size() - 9), "cut short");
  const auto with_note = [&](auto change) {
    ShardNote note = *ShardNote::from(whole_note(folder / "1.shard"));
    note.shards = {1};
    change(note);
    return whole + record_text(note.text());
  };
  expect_named(with_note([](ShardNote& note) { note.program = "clamor 0.0.1/1"; }),
               "made by clamor 0.0.1");
  expect_named(with_note([](ShardNote& note) { note.level_hash ^= 1; }), "is stale");
  expect_named(with_note([](ShardNote& note) { note.count = 7; }), "of 7 shards");
  expect_named(with_note([](ShardNote& note) { note.is_complete = false; }), "before its end");
  folder.write("2.shard", whole);
  EXPECT_NE(refusal(folder, {"1.shard", "2.shard"}).find("3 of 3 is in none of the shards"),
            std::string::npos);
}

TEST(Shards, ThatAreDamagedAreMendedByTheirCommand_NoAsan) {
  const Folder folder;
  const auto trace = [&] {
    return clamor(with(bake_words(folder / "1.shard"), {"--shard", "1/1"})).code;
  };
  ASSERT_EQ(trace(), 0);
  std::string bytes = read(folder / "1.shard");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  folder.write("1.shard", bytes);
  ASSERT_EQ(trace(), 0);
  EXPECT_EQ(clamor({"merge", folder / "1.shard", "-o", folder / "out.clamor", "--quiet"}).code, 0);
}

TEST(Shards, MergeInTwoStepsToTheSameBytes_NoAsan) {
  const Folder folder;
  ASSERT_EQ(clamor(with(bake_words(folder / "whole.clamor"), {"--no-journal"})).code, 0);
  for (const std::string i : {"1", "2", "3", "4", "5"})
    ASSERT_EQ(clamor(with(bake_words(folder / (i + ".shard")), {"--shard", i + "/5"})).code, 0);
  const auto join = [&](const std::string& output, const std::vector<std::string>& shards,
                        const std::string& kind) {
    std::vector<std::string> words{"merge", "-o", folder / output, "--quiet", kind};
    for (const std::string& shard : shards) words.push_back(folder / shard);
    const auto outcome = clamor(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  };
  join("a.shard", {"5.shard", "1.shard", "2.shard"}, "--to-shard");
  join("b.shard", {"3.shard", "4.shard"}, "--to-shard");
  join("merged.clamor", {"b.shard", "a.shard"}, "--strict");
  EXPECT_TRUE(read(folder / "merged.clamor") == read(folder / "whole.clamor"));
}

TEST(Inspect, PrintsTheCommandThatMakesTheFileAgain) {
  const Folder folder;
  ASSERT_EQ(clamor(bake_words(folder / "whole.clamor")).code, 0);
  const auto outcome = clamor({"inspect", folder / "whole.clamor"});
  EXPECT_NE(outcome.out.find("clamor bake violin_room.glb -o whole.clamor --emitter "
                             "'name=drum kit,signal=impulse,at=-1,1,2' --photons 7000 --sources "
                             "5000 --seed 3\n"),
            std::string::npos)
      << outcome.out;
}

// The pipe has no writer, so opening it as a normal file would block for ever.
TEST(Shards, OneThatIsAPipeIsRefusedAtOnce_NoAsan) {
  const Folder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto outcome = clamor({"merge", folder / "pipe", "-o", folder / "out.clamor"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("not a regular file"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace clamor
