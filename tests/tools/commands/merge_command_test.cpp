// Tests merging shards, and the command that a bake file names.
#include <sys/stat.h>

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

TEST(Shards, MergeInAnyOrderToTheBytesOfTheWholeBake) {
  const Folder folder;
  ASSERT_EQ(clamor(with(bake_words(folder / "whole.clamor"), {"--no-journal"})).code, 0);
  const std::string whole = read(folder / "whole.clamor");
  for (const int count : {1, 2, 5}) {
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

TEST(Shards, MissingForeignAndDamagedOnesGetASentenceAndNoOutput) {
  const Folder folder;
  for (const std::string i : {"1", "2"})
    ASSERT_EQ(clamor(with(bake_words(folder / i), {"--shard", i + "/2"})).code, 0);
  auto other = bake_words(folder / "other");
  other[10] = "4";  // the seed
  ASSERT_EQ(clamor(with(other, {"--shard", "2/2"})).code, 0);
  folder.write("text", "not a shard");
  std::string cut = read(folder / "2");
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
  expect_refused({"1"}, "none of the shards");
  expect_refused({"1", "other"}, "other options");
  expect_refused({"1", "text"}, "no traced photons");
  expect_refused({"1", "cut"}, "none of the shards");
  expect_refused({"1", "flipped"}, "none of the shards");
  expect_refused({"1", "gone"}, "cannot be read");
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "3/2"})).code, 2);
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "0/2"})).code, 2);
  EXPECT_EQ(clamor(with(bake_words(folder / "out.clamor"), {"--shard", "1of2"})).code, 2);
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
TEST(Shards, OneThatIsAPipeIsRefusedAtOnce) {
  const Folder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto outcome = clamor({"merge", folder / "pipe", "-o", folder / "out.clamor"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("not a regular file"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace clamor
