// Presets by the names of materials, in many languages.
#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/level/material_presets.h"
#include "formats/level/name_match.h"
#include "tests/build_paths.h"

namespace clamor::testing {
namespace {

struct NamedMaterial {
  std::string name;
  std::vector<std::string> presets;  // any of them is right; "-" means that the name tells nothing
};

// Lines "name TAB preset|preset" and comments, which say where the names come from.
std::vector<NamedMaterial> read_names(const std::string& file) {
  std::ifstream in(std::string(kSourceDir) + "/tests/formats/level/" + file);
  std::vector<NamedMaterial> names;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto tab = line.find('\t');
    NamedMaterial named{line.substr(0, tab), {}};
    std::istringstream presets(line.substr(tab + 1));
    for (std::string preset; std::getline(presets, preset, '|');) named.presets.push_back(preset);
    names.push_back(std::move(named));
  }
  return names;
}

struct Score {
  double mapped = 0;  // share of the names that tell something
  double right = 0;   // share of those that were mapped
  std::string wrong;
};

Score score_of(const std::vector<NamedMaterial>& names) {
  std::size_t telling = 0, mapped = 0, mapped_telling = 0, right = 0;
  Score score;
  for (const NamedMaterial& named : names) {
    const NameGuess guess = MaterialPresets::built_in().guess(named.name);
    const auto has = [&](const std::string& preset) {
      return std::ranges::find(named.presets, preset) != named.presets.end();
    };
    const bool tells = !has("-");
    telling += tells;
    if (!guess.is_sure()) continue;
    ++mapped;
    mapped_telling += tells;
    right += has(guess.preset);
    if (!has(guess.preset)) score.wrong += named.name + " -> " + guess.preset + "\n";
  }
  score.mapped = static_cast<double>(mapped_telling) / static_cast<double>(telling);
  score.right = static_cast<double>(right) / static_cast<double>(mapped);
  return score;
}

// The table of words was written without these names, and is not to be mended by them.
TEST(MaterialNames, ThatTheTableHasNotSeenMapAndMapRightly) {
  const auto names = read_names("material_names_held_out.tsv");
  ASSERT_GE(names.size(), 400u);
  const Score score = score_of(names);
  EXPECT_GE(score.mapped, 0.85);
  EXPECT_GE(score.right, 0.95) << score.wrong;
}

TEST(MaterialNames, ThatTheTableWasWrittenForAreAllRight) {
  const auto names = read_names("material_names.tsv");
  ASSERT_GE(names.size(), 100u);
  const Score score = score_of(names);
  EXPECT_EQ(score.mapped, 1);
  EXPECT_EQ(score.right, 1) << score.wrong;
}

TEST(MaterialNames, ListOnlyPresetsThatThereAre) {
  const auto& presets = MaterialPresets::built_in().names();
  for (const char* file : {"material_names.tsv", "material_names_held_out.tsv"})
    for (const NamedMaterial& named : read_names(file))
      for (const std::string& preset : named.presets)
        EXPECT_TRUE(preset == "-" || std::ranges::find(presets, preset) != presets.end())
            << named.name << ": " << preset;
}

TEST(MaterialNames, AreReadWithoutCaseAccentsAndSeparators) {
  EXPECT_EQ(letters_of("m_WallBrick.02").letters, "mwallbrick");
  EXPECT_EQ(letters_of("DÄMMUNG größe").letters, "dammunggrosse");
  EXPECT_EQ(letters_of("Ża\u0301łosny Œuvre").letters, "zalosnyoeuvre");
  EXPECT_EQ(letters_of("ЁЛКА").letters, "елка");
  EXPECT_EQ(letters_of("Ｇｌａｓｓ").letters, "glass");
  EXPECT_EQ(letters_of("\xff\xc3").letters, "") << "no UTF-8";
  const NameLetters name = letters_of("wallBrick");
  for (std::size_t i = 0; i <= name.letters.size(); ++i)
    EXPECT_EQ(name.begins[i], i == 0 || i == 4 || i == 9) << i;
  const auto preset = [](const char* text) {
    return MaterialPresets::built_in().guess(text).preset;
  };
  for (const char* text : {"stone wool", "StoneWool", "stonewool", "STONE_WOOL.001"})
    EXPECT_EQ(preset(text), "mineral_wool") << text;
}

TEST(MaterialNames, LetTheLongestAliasTakeItsLetters) {
  const auto presets = MaterialPresets::parse(R"({"materials": {
    "hard": {"absorption": 0.02, "scattering": 0.1},
    "soft": {"absorption": 0.7, "scattering": 0.1},
    "treated": {"absorption": 0.6, "scattering": 0.1}}})",
                                              R"(# aliases
hard
  en: stone*, concrete
  de: ~table

soft
  en: stone wool, carpet, ~seat
treated
  en: !perforated*
-
  en: stone age)");
  ASSERT_TRUE(presets.ok()) << presets.error().message;
  const auto guess = [&](const char* name) {
    const NameGuess found = presets->guess(name);
    return found.preset + (found.doubt.empty() ? "" : " or " + found.doubt);
  };
  EXPECT_EQ(guess("stone"), "hard");
  EXPECT_EQ(guess("stone_wool"), "soft");
  EXPECT_EQ(guess("Stone Age"), "");
  EXPECT_EQ(guess("carpet table"), "soft") << "a thing yields to a substance";
  EXPECT_EQ(guess("table"), "hard");
  EXPECT_EQ(guess("table seat"), "hard or soft") << "things may be opposites, too";
  EXPECT_EQ(guess("concrete carpet"), "hard or soft");
  EXPECT_EQ(guess("concrete stone"), "hard") << "of the same kind";
  EXPECT_EQ(guess("perforated concrete"), "treated");
  EXPECT_FALSE(MaterialPresets::parse(R"({"materials": {}})", "hard\n  en: stone").ok());
}

// Aliases are compared as they are written.
TEST(MaterialNames, AreListedInTheLettersInWhichTheyAreCompared) {
  std::ifstream in(std::string(kSourceDir) + "/assets/material_names.txt");
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("  ")) continue;
    for (char& c : line.erase(0, line.find(':') + 1))
      if (std::string_view("*,~!").find(c) != std::string_view::npos) c = ' ';
    std::istringstream words(line);
    for (std::string word; words >> word;) EXPECT_EQ(letters_of(word).letters, word);
  }
}

}  // namespace
}  // namespace clamor::testing
