// octree_pool_baked_instances_test.cpp: levels with repeated groups, baked into instances and
// sampled.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/bake.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/expanded_sources.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/sanitized.h"
#include "tests/stadium_level.h"

namespace clamor {
namespace {

using testing::StadiumLevel;

struct How {
  std::uint64_t seed = 1;
  bool copies = true;
  int threads = 1;
  std::uint64_t photons = 500, sources = 0;
};

// A bake of the level, written to a file and opened.
struct Baked {
  Baked(const StadiumLevel& stadium_level, const How& how)
      : path((std::filesystem::temp_directory_path() /
              ("clamor_stadium_" + std::to_string(::getpid()) + "_" + std::to_string(next_++) +
               ".clamor"))
                 .string()) {
    BakeOptions options{
        .settings = {.seed = how.seed, .photons = how.photons, .sources = how.sources},
        .threads = how.threads};
    if (how.copies) options.groups = stadium_level.groups;
    const auto contents = bake(stadium_level.level, options, &report);
    EXPECT_TRUE(contents.ok()) << (contents.ok() ? "" : contents.error().message);
    const auto done = write_bake(path, *contents, how.threads);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    auto opened = BakeFile::open(path);
    EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.error().message);
    file = std::make_unique<BakeFile>(std::move(*opened));
  }
  ~Baked() { std::filesystem::remove(path); }

  std::string bytes() const {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  static inline int next_ = 0;
  const std::string path;
  BakeReport report;
  std::unique_ptr<BakeFile> file;
};

StadiumLevel stadium_level(bool ground) {
  StadiumLevel all;
  all.fans = 60;
  all.blocks = 8;
  all.stands = 5;
  all.ground = ground;
  all.build();
  return all;
}

// For each direct source, the emitter of the level at its place.
std::vector<std::size_t> emitters_of(const StadiumLevel& level, const ExpandedSources& all) {
  std::vector<std::size_t> found;
  for (const Source& source : all.sources) {
    if (!source.is_emitter) continue;
    std::size_t nearest = 0;
    double least_m = 1e9;
    for (std::size_t e = 0; e < level.level.emitters.size(); ++e) {
      const double away_m = length(Vec3(source.position_m) - level.level.emitters[e].position_m);
      if (away_m < least_m) {
        least_m = away_m;
        nearest = e;
      }
    }
    found.push_back(nearest);
  }
  return found;
}

TEST(BakedInstances, HaveTheEmittersOfTheLevel) {
  for (const bool ground : {false, true}) {
    const StadiumLevel level = stadium_level(ground);
    const Baked baked(level, {});
    EXPECT_GT(baked.report.instanced_groups, 0u);
    EXPECT_EQ(baked.report.instanced_sources, level.count());
    EXPECT_LT(baked.file->stored_sources(), baked.file->source_count());
    const auto all = read_expanded_sources(*baked.file);
    ASSERT_TRUE(all.ok());
    const auto emitters = emitters_of(level, *all);
    ASSERT_EQ(emitters.size(), level.count());
    std::vector<bool> found(level.count(), false);
    std::size_t next = 0;
    for (const Source& source : all->sources) {
      if (!source.is_emitter) continue;
      const std::size_t number = emitters[next++];
      EXPECT_FALSE(found[number]);
      found[number] = true;
      const Emitter& expected = level.level.emitters[number];
      const Emitter& played = all->emitters[source.emitter];
      ASSERT_LT(length(Vec3(source.position_m) - expected.position_m), 1e-3);
      ASSERT_LT(length(Vec3(source.normal) - expected.axis), 1e-3);
      ASSERT_EQ(played.signal, expected.signal);
      ASSERT_EQ(played.directivity, expected.directivity);
      ASSERT_NEAR(played.delay_s + static_cast<double>(source.delay_s), expected.delay_s,
                  1 / 48000.0);
      for (std::size_t b = 0; b < kBandCount; ++b)
        ASSERT_NEAR(
            10 * std::log10(static_cast<double>(source.power[b]) * (expected.directivity[b] + 1) /
                            (4 * 3.14159265 * expected.gain * expected.gain)),
            0, 0.25);
      if (ground) {
        ASSERT_EQ(all->stored_as[source.emitter], number);
      }
    }
  }
}

TEST(BakedInstances, KeepTheEmitterTableThatReflectionsUse) {
  const StadiumLevel level = stadium_level(true);
  const Baked with(level, {}), without(level, {.copies = false});
  ASSERT_EQ(with.file->emitters().size(), level.count());
  for (std::size_t e = 0; e < level.count(); ++e) {
    const Emitter &a = with.file->emitters()[e], &b = level.level.emitters[e];
    ASSERT_EQ(a.name, b.name);
    ASSERT_LT(length(a.position_m - b.position_m), 1e-3);
    ASSERT_EQ(a.signal, b.signal);
    ASSERT_NEAR(a.gain, b.gain, 1e-4 * b.gain);
    ASSERT_NEAR(a.delay_s, b.delay_s, 2e-6);
  }
  // The reflections are bit-identical.
  const auto reflections = [](const Baked& baked) {
    std::vector<Source> sources;
    const auto all = read_expanded_sources(*baked.file);
    for (const Source& source : all->sources)
      if (!source.is_emitter) {
        sources.push_back(source);
        sources.back().emitter = all->stored_as[source.emitter];
      }
    return sources;
  };
  const auto a = reflections(with), b = reflections(without);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 100u);
  double power_a = 0, power_b = 0;
  std::vector<std::uint64_t> of_a(level.count()), of_b(level.count());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ++of_a[a[i].emitter];
    ++of_b[b[i].emitter];
    power_a += static_cast<double>(a[i].power[3]);
    power_b += static_cast<double>(b[i].power[3]);
  }
  EXPECT_EQ(of_a, of_b);
  EXPECT_NEAR(power_a / power_b, 1, 1e-9);
  // A third of the root was the emitter table.
  EXPECT_LT(3 * with.file->bytes().root, 2 * without.file->bytes().root);
}

// Received power per band of a sample, or of all sources.
class Listening {
 public:
  explicit Listening(const Baked& baked) : baked_(baked) {
    radiation_ =
        std::make_unique<RadiationModel>(baked.file->emitters(), baked.file->materials(), Air{});
    for (std::size_t s = 0; s < baked.file->signal_count(); ++s)
      weights_.by_signal.push_back(same_in_all_bands(1.0f + 0.3f * static_cast<float>(s)));
    ceilings_ = max_over_instances(weights_, baked.file->signal_maps());
    loader_ = std::make_unique<PageLoader>(page_fetch(*baked.file, *radiation_, ceilings_),
                                           PageBudget{200'000'000});
    pool_ = std::make_unique<OctreePool>(*radiation_, ceilings_, baked.file->trees(),
                                         baked.file->signal_maps(), *loader_);
  }

  std::array<double, kBandCount> sampled(std::size_t voices, const Vec3& place) {
    const auto sampler = make_priority_sampler(*radiation_, weights_, *pool_, voices);
    auto sample = sampler->sample(place);
    while (!sampler->complete()) sample = sampler->sample(place);
    EXPECT_EQ(sample.size(), voices);
    std::array<double, kBandCount> heard{};
    for (const SampledSource& one : sample)
      add(*one.source, one.signal, one.power_scale, place, heard);
    return heard;
  }

  std::array<double, kBandCount> whole(const Vec3& place) {
    const auto all = read_expanded_sources(*baked_.file);
    EXPECT_TRUE(all.ok());
    field_all_ = std::make_unique<RadiationModel>(all->emitters, baked_.file->materials(), Air{});
    std::array<double, kBandCount> heard{};
    for (const Source& source : all->sources)
      for (std::size_t b = 0; b < kBandCount; ++b)
        heard[b] +=
            weight(*field_all_, only(b, all->emitters[source.emitter].signal), source, place);
    return heard;
  }

 private:
  Bands only(std::size_t band, std::uint32_t signal) const {
    Bands weights{};
    weights[band] = weights_.by_signal[signal][band];
    return weights;
  }

  void add(const Source& source, std::uint32_t signal, double scale, const Vec3& place,
           std::array<double, kBandCount>& heard) const {
    for (std::size_t b = 0; b < kBandCount; ++b)
      heard[b] += scale * weight(*radiation_, only(b, signal), source, place);
  }

  const Baked& baked_;
  std::unique_ptr<RadiationModel> radiation_, field_all_;
  SignalWeights weights_, ceilings_;
  std::unique_ptr<PageLoader> loader_;
  std::unique_ptr<OctreePool> pool_;
};

const Vec3 kPlaces[] = {{0, 2, 0}, {30, 3, 25}};

TEST(BakedInstances, AreUnbiasedInEveryBand) {
  const StadiumLevel level = stadium_level(false);
  const int seeds = testing::kSanitized ? 8 : 40;
  std::array<std::array<double, kBandCount>, 2> whole{};
  std::array<std::array<std::vector<double>, kBandCount>, 2> ratios;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const Baked baked(level, {.seed = seed});
    Listening listening(baked);
    for (std::size_t p = 0; p < 2; ++p) {
      if (seed == 1) whole[p] = Listening(Baked(level, {.copies = false})).whole(kPlaces[p]);
      const auto heard = listening.sampled(100, kPlaces[p]);
      for (std::size_t b = 0; b < kBandCount; ++b) ratios[p][b].push_back(heard[b] / whole[p][b]);
    }
  }
  for (const auto& place : ratios)
    for (const auto& band : place) {
      double mean = 0, squares = 0;
      for (const double ratio : band) mean += ratio / seeds;
      for (const double ratio : band) squares += (ratio - mean) * (ratio - mean);
      const double sigma = std::sqrt(squares / (seeds - 1));
      EXPECT_NEAR(mean, 1, 3 * sigma / std::sqrt(static_cast<double>(seeds)));
      EXPECT_LT(sigma, 1.5 / std::sqrt(99.0));  // the bound of priority sampling, plus noise
    }
}

TEST(BakedInstances, HaveTheTotalPowerOfTheLevel_NoAsan) {
  for (const bool ground : {false, true}) {
    const StadiumLevel level = stadium_level(ground);
    for (const Vec3& place : kPlaces) {
      const auto with = Listening(Baked(level, {})).whole(place);
      const auto without = Listening(Baked(level, {.copies = false})).whole(place);
      // Positions differ by micrometres, for fans 10 m away.
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_NEAR(10 * std::log10(with[b] / without[b]), 0, 1e-4);
    }
  }
}

TEST(BakedInstances, AreTheSameBytesWithAnyNumberOfThreads) {
  const StadiumLevel level = stadium_level(true);
  const std::string one = Baked(level, {.threads = 1}).bytes();
  for (const int threads : {2, 5}) EXPECT_TRUE(one == Baked(level, {.threads = threads}).bytes());
  EXPECT_FALSE(one == Baked(level, {.seed = 2}).bytes());
}

// With little memory the bake sorts the octree on disk and adds the instances all the same.
TEST(BakedInstances, AreTheSameSourcesWithAnyMemoryLimit) {
  const StadiumLevel level = stadium_level(true);
  const Baked whole(level, {});
  BakeOptions options{.settings = {.photons = 500, .sources = 1'000'000}, .threads = 1};
  options.groups = level.groups;
  options.spill = whole.path + ".sorted";
  Result<BakeContents> contents = Error("");
  for (options.memory_bytes = 100'000'000; !contents.ok() && options.memory_bytes < 400'000'000;
       options.memory_bytes += 10'000'000)
    contents = bake(level.level, options);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  ASSERT_TRUE(contents->stream_octree);
  ASSERT_TRUE(write_bake(options.spill, *contents, 1).ok());
  const auto file = BakeFile::open(options.spill);
  ASSERT_TRUE(file.ok()) << file.error().message;
  const auto a = read_expanded_sources(*whole.file), b = read_expanded_sources(*file);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->sources.size(), b->sources.size());
  for (std::size_t i = 0; i < a->sources.size(); ++i) {
    ASSERT_EQ(a->sources[i].position_m, b->sources[i].position_m);
    ASSERT_EQ(a->sources[i].u, b->sources[i].u);
    ASSERT_EQ(a->sources[i].power, b->sources[i].power);
    ASSERT_EQ(a->sources[i].emitter, b->sources[i].emitter);
  }
  std::filesystem::remove(options.spill);
}

TEST(BakedInstances, StoreAMillionFansInAFewHundredKilobytes_NoAsan) {
  for (const bool ground : {false, true}) {
    StadiumLevel level;
    level.fans = testing::kSanitized ? 100 : 1000;
    level.blocks = 25;
    level.stands = 40;
    level.ground = ground;
    level.build();
    const Baked baked(level, {.photons = 5000, .sources = 20'000});
    EXPECT_GE(baked.file->source_count(), level.count());
    EXPECT_EQ(baked.report.instanced_sources, level.count());
    EXPECT_LT(baked.file->bytes().file, ground ? 600'000u : 400'000u);
    Listening listening(baked);
    for (int i = 0; i < 5; ++i) EXPECT_GT(listening.sampled(500, {4.0 * i, 2, 0.0})[4], 0);
  }
}

}  // namespace
}  // namespace clamor
