#include "formats/bake_file/emitter_table.h"

#include "formats/bake_file/bake_layout.h"
#include "tests/formats/forged_root.h"

namespace clamor::testing {
namespace {

using Root = BakeRoot::Builder;

// Repeats `count` emitters from `from` at `at` without changes.
void fill(::EmitterInstance::Builder run, std::uint32_t at, std::uint32_t from,
          std::uint32_t count) {
  run.setAt(at);
  run.setFrom(from);
  run.setCount(count);
  run.setSignals(kSameSignals);
  run.setRotationW(1);
  run.setScale(1);
  run.setGain(1);
}

void put_names(Root root, const std::string& names) {
  const auto frame = packed(std::as_bytes(std::span(names)));
  root.setEmitterNames(kj::arrayPtr(reinterpret_cast<const kj::byte*>(frame.data()), frame.size()));
  root.setEmitterNamesBytes(names.size());
}

// An instance of the only emitter, translated by 2 m in x.
void add_run(Root root) {
  auto run = root.initEmitterInstances(1)[0];
  fill(run, 1, 0, 1);
  run.setOffsetX(2);
  run.setGain(0.5f);
  run.setDelayS(-0.125);
  put_names(root, std::string("\1viola\0", 7));
}

TEST(EmitterTable, ExpandsRunsOfInstances) {
  const Bytes bytes = with_root(written(contents()), add_run);
  const std::string path = path_of("table.clamor");
  std::ofstream(path, std::ios::binary) << bytes;
  const auto bake = BakeFile::open(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(bake.ok()) << bake.error().message;
  ASSERT_EQ(bake->emitters().size(), 2u);
  const Emitter &violin = bake->emitters()[0], &viola = bake->emitters()[1];
  EXPECT_EQ(viola.name, "viola");
  EXPECT_LT(length(viola.position_m - violin.position_m - Vec3(2, 0, 0)), 1e-12);
  EXPECT_LT(length(viola.axis - violin.axis), 1e-12);
  EXPECT_EQ(viola.gain, violin.gain / 2);
  EXPECT_EQ(viola.delay_s, violin.delay_s - 0.125);
  EXPECT_EQ(viola.directivity, violin.directivity);
}

TEST(EmitterTable, OmitsInheritedNames) {
  std::vector<Emitter> table(5);
  for (const std::size_t i : {0u, 1u}) table[i].name = "fan " + std::to_string(i);
  table[2].name = "fan 0";
  table[4].name = "the other";
  EmitterInstance run;
  run.at = 2;
  run.count = 2;
  EmitterInstance last;
  last.at = 4;
  last.count = 1;
  const std::string list = list_names(table, std::vector{run, last});
  EXPECT_EQ(list.size(), 1 + 2 + 11u);
  NameList names(std::as_bytes(std::span(list)));
  for (const std::size_t i : {2u, 3u, 4u}) {
    std::string name = table[i == 4 ? 0 : i - 2].name;
    ASSERT_TRUE(names.next(name).ok());
    EXPECT_EQ(name, table[i].name);
  }
  EXPECT_TRUE(names.at_end());
  std::string name;
  EXPECT_FALSE(names.next(name).ok());
}

TEST(EmitterTable, ShortensLongNames) {
  const std::string name = "begin" + std::string(10'000, 'x') + "end", list = '\1' + name + '\0';
  NameList names(std::as_bytes(std::span(list)));
  std::string read;
  ASSERT_TRUE(names.next(read).ok());
  EXPECT_LE(read.size(), 500u);
  EXPECT_TRUE(read.starts_with("beginx") && read.ends_with("xend")) << read;
}

TEST(EmitterTable, ThatIsInvalidIsRejected) {
  const Bytes whole = written(contents());
  const struct {
    const char* what;
    std::function<void(::EmitterInstance::Builder)> change;
  } kRuns[] = {
      {"a run that copies itself", [](auto run) { run.setFrom(1); }},
      {"a run of what comes later", [](auto run) { run.setFrom(7); }},
      {"a run over its own end", [](auto run) { run.setCount(2); }},
      {"a run without end", [](auto run) { run.setCount(0xffffffffu); }},
      {"a run of nobody", [](auto run) { run.setCount(0); }},
      {"a run after a gap", [](auto run) { run.setAt(2); }},
      {"a run over another", [](auto run) { run.setAt(0); }},
      {"a run at the end of the world", [](auto run) { run.setAt(0xffffffffu); }},
      {"a run that is nowhere", [](auto run) { run.setOffsetY(kNaN); }},
      {"a run that is stretched", [](auto run) { run.setScale(3); }},
      {"a run that is turned by no turn", [](auto run) { run.setRotationW(0); }},
      {"a run of infinite gain", [](auto run) { run.setGain(INFINITY); }},
      {"a run in a thousand years", [](auto run) { run.setDelayS(3e10); }},
      {"a run that plays no map", [](auto run) { run.setSignals(0); }},
  };
  for (const auto& run : kRuns)
    EXPECT_FALSE(read_whole(with_root(whole,
                                      [&](Root root) {
                                        add_run(root);
                                        run.change(root.getEmitterInstances()[0]);
                                      }))
                     .ok())
        << run.what;
  const struct {
    const char* what;
    std::function<void(Root)> change;
  } kNames[] = {
      {"no names", [](Root root) { put_names(root, ""); }},
      {"too many names", [](Root root) { put_names(root, std::string(2, '\0')); }},
      {"a name cut short", [](Root root) { put_names(root, "\1viol"); }},
      {"names of a terabyte", [](Root root) { root.setEmitterNamesBytes(1ull << 40); }},
      {"names that are no frame", [](Root root) { root.initEmitterNames(5); }},
  };
  for (const auto& names : kNames)
    EXPECT_FALSE(read_whole(with_root(whole,
                                      [&](Root root) {
                                        add_run(root);
                                        names.change(root);
                                      }))
                     .ok())
        << names.what;
}

// Runs that double the table repeatedly: a few kilobytes would expand to gigabytes.
TEST(EmitterTable, HasLimitsThatDependOnTheSizeOfTheFile) {
  const auto doubled = [](unsigned times, unsigned named) {
    return with_root(written(contents()), [=](Root root) {
      auto runs = root.initEmitterInstances(times);
      for (unsigned i = 0; i < times; ++i) fill(runs[i], 1u << i, 0, 1u << i);
      std::string names;
      for (unsigned i = 1; i < 1u << times; ++i)
        if (i <= named)
          names += '\1' + std::to_string(philox(1, {i, 0, 0, 0})[0]) + '\0';
        else
          names += '\0';
      put_names(root, names);
    });
  };
  EXPECT_TRUE(read_whole(doubled(8, 0)).ok());
  for (const unsigned times : {16u, 20u}) {
    const auto read = read_whole(doubled(times, 100));
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().message.find("more emitters than a file of its size"), std::string::npos)
        << read.error().message;
  }
}

// Every instance inherits a long name, which the file stores once and the table once per instance.
TEST(EmitterTable, CountsInheritedNamesForEveryInstance) {
  const auto instanced_with_name = [](std::size_t letters, unsigned times) {
    return with_root(written(contents()), [=](Root root) {
      root.getEmitters()[0].setName(std::string(letters, 'a'));
      auto runs = root.initEmitterInstances(times);
      for (unsigned i = 0; i < times; ++i) fill(runs[i], 1u << i, 0, 1u << i);
      put_names(root, std::string((1u << times) - 1, '\0'));
    });
  };
  EXPECT_TRUE(read_whole(instanced_with_name(100, 8)).ok());
  EXPECT_TRUE(read_whole(instanced_with_name(100'000, 8)).ok());  // 500 of them are read
  const auto read = read_whole(instanced_with_name(500, 12));
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("names of its instanced emitters take more"),
            std::string::npos)
      << read.error().message;
}

}  // namespace
}  // namespace clamor::testing
