// Tests that man pages and completions hold every option of --help, and that their readers take
// them.
#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/shell.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using testing::has;
using testing::read;

const std::vector<std::string> kCommands = {
    "bake",  "merge",  "farm",    "inspect", "report",     "diff",      "play",   "view",
    "bench", "render", "impulse", "compare", "experiment", "materials", "devices"};

// The options that a command's --help lists.
std::set<std::string> options_of(const std::string& command) {
  const std::string help = clamor({command, "--help"}).out;
  std::set<std::string> options;
  std::istringstream lines(help.substr(help.find("Options:")));
  for (std::string line; std::getline(lines, line);) {
    std::smatch names;
    if (std::regex_search(line, names, std::regex("^  (-[a-z]),(--[a-z-]+)"))) {
      options.insert({names[1], names[2]});
    } else if (std::regex_search(line, names, std::regex("^  (--[a-z-]+)"))) {
      options.insert(names[1]);
    }
  }
  EXPECT_GE(options.size(), 2u) << help;
  return options;
}

class Manual : public ::testing::Test {
 protected:
  Manual() { EXPECT_EQ(clamor({"manual", folder_.path()}).code, 0); }

  // Runs a shell command in the folder and returns its output.
  std::string output(const std::string& command) const {
    const std::string script = folder_.write("script", command);
    EXPECT_EQ(std::system(("cd " + folder_.path() + " && bash script >out 2>&1").c_str()), 0)
        << command << "\n"
        << read(folder_ / "out");
    return read(folder_ / "out");
  }

  // The part of a file from `begin` to `end`.
  std::string part(const std::string& name, const std::string& begin,
                   const std::string& end) const {
    const std::string text = read(folder_ / name);
    const std::size_t from = text.find(begin);
    EXPECT_NE(from, std::string::npos) << begin;
    return from == std::string::npos ? "" : text.substr(from, text.find(end, from) - from);
  }

  // The completions of bash after these words, one a line.
  std::string bash(const std::string& words) const {
    return output(". bash-completion/completions/clamor; COMP_WORDS=(" + words +
                  "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _clamor; "
                  "printf '%s\\n' \"${COMPREPLY[@]}\"");
  }

  Folder folder_;
};

TEST_F(Manual, HasEveryOptionOfTheHelp_NoAsan) {
  for (const std::string& command : kCommands) {
    const std::string page = read(folder_ / ("man/man1/clamor-" + command + ".1"));
    const std::string of_bash =
        part("bash-completion/completions/clamor", "    " + command + ")", ";;\n    ");
    const std::string of_zsh = part("zsh/site-functions/_clamor", "    " + command + ") ", ";;\n");
    const std::string of_fish = read(folder_ / "fish/vendor_completions.d/clamor.fish");
    for (const std::string& option : options_of(command)) {
      const std::string in_roff =
          "\\fB" + std::regex_replace(option, std::regex("-"), "\\-") + "\\fR";
      EXPECT_NE(page.find(in_roff), std::string::npos) << command << option << page;
      EXPECT_NE((of_bash + " ").find(option), std::string::npos) << command << option << of_bash;
      EXPECT_NE(of_zsh.find(option + "["), std::string::npos) << command << option << of_zsh;
      const bool short_name = option.size() == 2;
      const std::regex in_fish("seen_subcommand_from " + command + "'[^\n]* -" +
                               (short_name ? "s " : "l ") + option.substr(short_name ? 1 : 2) +
                               " ");
      EXPECT_TRUE(std::regex_search(of_fish, in_fish)) << command << option;
    }
    EXPECT_NE(read(folder_ / "man/man1/clamor.1").find("clamor " + command), std::string::npos);
  }
}

TEST_F(Manual, HasAPageForEachCommandOfAFarm_NoAsan) {
  for (const std::string command : {"status", "resume", "merge"}) {
    const std::string page = read(folder_ / ("man/man1/clamor-farm-" + command + ".1"));
    EXPECT_NE(page.find("\\fBclamor farm " + command + "\\fR"), std::string::npos) << page;
    EXPECT_EQ(clamor({"farm", command, "--help"}).code, 0);
  }
  EXPECT_NE(read(folder_ / "man/man1/clamor-farm-resume.1").find("\\-\\-slurm"), std::string::npos);
}

// Words that completions offer must be in the help, so that they are dropped together.
TEST_F(Manual, OffersWordsThatTheHelpNames_NoAsan) {
  for (const std::string& command : kCommands) {
    const std::string help = clamor({command, "--help"}).out;
    const std::string completion =
        part("bash-completion/completions/clamor", "    " + command + ")", ";;\n    ");
    const std::regex values("words='([^']*)'");
    for (std::sregex_iterator found(completion.begin(), completion.end(), values), end;
         found != end; ++found) {
      std::istringstream words((*found)[1]);
      for (std::string word; words >> word;) EXPECT_NE(help.find(word), std::string::npos) << word;
    }
  }
}

TEST_F(Manual, CompletesInBash_NoAsan) {
  output("bash -n bash-completion/completions/clamor");
  EXPECT_EQ(bash("clamor re"), "report\nrender\n");
  EXPECT_EQ(bash("clamor render --vis"), "--visibility\n");
  EXPECT_EQ(bash("clamor render --visibility ''"), "on\noff\n");
  EXPECT_EQ(bash("clamor render room.clamor --format = f"), "float\n");
  EXPECT_EQ(bash("clamor experiment mo"), "motion\n");
  EXPECT_EQ(bash("clamor bake -o --"), "\n");  // file names
  EXPECT_EQ(bash("clamor farm ''"), "status\nresume\nmerge\n");
  EXPECT_EQ(bash("clamor farm room.glb --sl"), "--slurm\n");
  EXPECT_EQ(bash("clamor farm resume room.clamor --s"), "--slurm\n");
  EXPECT_EQ(bash("clamor farm status room.clamor --s"), "\n");
  EXPECT_EQ(bash("clamor farm status --js"), "--json\n");
}

TEST_F(Manual, CompletesInZsh_NoAsan) {
  if (!has("zsh")) GTEST_SKIP() << "not on this machine: zsh";
  // _describe and _arguments stand in for zsh's own, and print what they are given.
  const std::string given = output(
      "zsh -f -c '_describe() { print -l $commands }; _arguments() { print -rl -- \"$@\" };"
      "compadd() { }; words=(clamor render \"\"); CURRENT=3; . zsh/site-functions/_clamor'");
  EXPECT_THAT(given, ::testing::HasSubstr("(--visibility)--visibility[on or off\\: occlusion of "
                                          "sources by surfaces]:TEXT:(on off)\n"));
  EXPECT_THAT(given, ::testing::HasSubstr("\n:bake:_files\n"));
  const auto after = [this](const std::string& words, int current) {
    return output(
        "zsh -f -c '_arguments() { print -rl -- \"$@\" }; compadd() { print -- \"$@\" };"
        "words=(" +
        words + "); CURRENT=" + std::to_string(current) + "; . zsh/site-functions/_clamor'");
  };
  EXPECT_THAT(after("clamor farm \"\"", 3), ::testing::StartsWith("-- status resume merge\n"));
  EXPECT_THAT(after("clamor farm resume \"\"", 4),
              ::testing::AllOf(::testing::HasSubstr("--slurm["),
                               ::testing::Not(::testing::HasSubstr("--shards"))));
  EXPECT_THAT(after("clamor farm room.glb \"\"", 4), ::testing::HasSubstr("--shards["));
}

TEST_F(Manual, CompletesInFish_NoAsan) {
  if (!has("fish")) GTEST_SKIP() << "not on this machine: fish";
  const std::string complete = "fish -N -c 'source fish/vendor_completions.d/clamor.fish; ";
  EXPECT_THAT(output(complete + "complete -C \"clamor ren\"'"), ::testing::StartsWith("render\t"));
  EXPECT_THAT(output(complete + "complete -C \"clamor render --visibility o\"'"),
              ::testing::AllOf(::testing::HasSubstr("on\t"), ::testing::HasSubstr("off\t")));
  EXPECT_THAT(output(complete + "complete -C \"clamor farm re\"'"),
              ::testing::StartsWith("resume\t"));
  EXPECT_THAT(output(complete + "complete -C \"clamor farm merge --\"'"),
              ::testing::AllOf(::testing::HasSubstr("--help"),
                               ::testing::Not(::testing::HasSubstr("--to-shard")),
                               ::testing::Not(::testing::HasSubstr("--shards"))));
  EXPECT_THAT(output(complete + "complete -C \"clamor merge --to\"'"),
              ::testing::StartsWith("--to-shard"));
}

TEST_F(Manual, IsCleanToMandoc_NoAsan) {
  if (!has("mandoc")) GTEST_SKIP() << "not on this machine: mandoc";
  // Pages have no date, so that the same source gives the same bytes.
  EXPECT_EQ(output("mandoc -T lint -W warning man/man1/*.1 | grep -v 'missing date' || true"), "");
}

TEST_F(Manual, IsCleanToGroff_NoAsan) {
  if (!has("groff")) GTEST_SKIP() << "not on this machine: groff";
  EXPECT_EQ(output("for page in man/man1/*.1; do groff -man -ww -Tutf8 $page >/dev/null; done"),
            "");
  EXPECT_THAT(output("groff -man -Tascii -P-c man/man1/clamor-render.1 | col -b"),
              ::testing::HasSubstr("--visibility"));
}

TEST_F(Manual, SaysWhereItCannotWrite_NoAsan) {
  const auto outcome = clamor({"manual", folder_.write("file", "")});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, ::testing::HasSubstr("file/man/man1/clamor.1 cannot be written"));
}

}  // namespace
}  // namespace clamor
