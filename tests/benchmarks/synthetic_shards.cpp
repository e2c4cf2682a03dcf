#include "tests/benchmarks/synthetic_shards.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bake/bake_plan.h"
#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/journal/shard_note.h"
#include "bake/journal/trace_journal.h"
#include "bake/report/level_report.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/maths.h"
#include "common/random.h"
#include "common/thread_team.h"
#include "formats/gltf/level_import.h"
#include "tests/source_lists.h"
#include "tools/commands/bake_arguments.h"

namespace clamor::testing {

namespace {

void draw(std::uint64_t i, Deposit& deposit) {
  const RandomBits counter{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32), 0,
                           0};
  const RandomBits a = philox(1, counter), b = philox(2, counter);
  const WallPoint point = wall_point(b[3] % 6, a, b);
  deposit.position_m = Vec3f(point.position_m);
  deposit.normal = Vec3f(point.normal);
  deposit.mirror = Vec3f(point.mirror);
  deposit.delay_s = static_cast<float>(0.02 + 1.5 * unit(b[0]));
  const float power = exp2_of(static_cast<float>(-19.93 * unit(b[0])));  // -60 dB at the end
  for (std::size_t band = 0; band < kBandCount; ++band)
    deposit.power[band] = power * (1 - 0.04f * static_cast<float>(band));
  deposit.random = static_cast<float>(unit_above_zero(b[1]));
  deposit.photon = static_cast<std::uint16_t>(i % kRunPhotons);
}

// The settings with which `clamor merge` looks runs up.
TraceSettings settings_of(const Scene& scene, const Level& level, const BakeSettings& settings) {
  TraceSettings trace = trace_settings(settings);
  const BakePlan plan = make_bake_plan(scene, level, settings, trace);
  trace.deposit_threshold = plan.deposit_threshold;
  trace.decay = plan.decay;
  return trace;
}

}  // namespace

// Writes the shards of a level. Its calls may be concurrent.
class SyntheticShards::Writer {
 public:
  Writer(Level level, const BakeSettings& settings, std::uint64_t deposits)
      : level_(std::move(level)),
        scene_(level_.mesh),
        tracer_(scene_, level_, settings_of(scene_, level_, settings)),
        photons_(settings.photons),
        deposits_(deposits) {}

  // Writes a shard and returns its size.
  Result<std::uint64_t> write(const std::string& path, const ShardNote& note) const {
    OpenJournals journals;
    journals.writes = true;
    auto journal = TraceJournal::open(path, level_.materials.size());
    if (!journal.ok()) return journal.error();
    journals.list.push_back(std::move(*journal));
    JournalSet set(journals, RunKeys(level_, tracer_, scene_hash(level_, tracer_.settings())));
    TracedRuns traced;
    for (std::uint64_t run = note.shards[0]; run * kRunPhotons < photons_; run += note.count) {
      traced.clear();
      draw_run(run, traced);
      if (auto added = set.record(traced); !added.ok()) return added.error();
    }
    if (auto noted = journals.list.front().set_note(note.text()); !noted.ok()) return noted.error();
    if (auto synced = journals.list.front().sync(); !synced.ok()) return synced.error();
    return journals.list.front().bytes();
  }

 private:
  void draw_run(std::uint64_t run, TracedRuns& traced) const {
    const std::uint64_t runs = photons_ / kRunPhotons, first = run * deposits_ / runs,
                        end = (run + 1) * deposits_ / runs;
    std::vector<Deposit> deposits(end - first);
    for (std::uint64_t i = first; i < end; ++i) draw(i, deposits[i - first]);
    TraceTally tally;
    tally.photons = kRunPhotons;
    tally.bounces = deposits.size();
    traced.append({0, run * kRunPhotons, kRunPhotons}, tally, deposits);
  }

  Level level_;
  Scene scene_;
  PhotonTracer tracer_;
  std::uint64_t photons_, deposits_;
};

SyntheticShards::SyntheticShards(const Folder& folder, std::uint64_t sources, std::uint32_t shards)
    : photons_(std::max<std::uint64_t>(sources / 32'000, std::uint64_t{4} * shards) * kRunPhotons),
      deposits_(sources + sources / 4) {
  request_.level_path = level_of(folder, box({20, 8, 15}));
  request_.import.emitters = {"name=click,signal=impulse,at=5,2,4"};
  request_.photons = std::to_string(photons_);
  request_.sources = std::to_string(sources);
  request_.early_order = "0";
  for (std::uint32_t i = 0; i < shards; ++i)
    paths_.push_back(folder / ("box." + std::to_string(i + 1) + ".shard"));
}

Result<void> SyntheticShards::write() {
  auto imported = import_level(request_.level_path, request_.import);
  if (!imported.ok()) return imported.error();
  (void)prepare_level(imported->level, {});
  BakeSettings settings;
  settings.air = imported->level.air;
  settings.photons = photons_;
  settings.sources = *whole_number(*request_.sources);
  const Writer writer(std::move(imported->level), settings, deposits_);
  const auto count = static_cast<std::uint32_t>(paths_.size());
  std::vector<Result<std::uint64_t>> written(count, std::uint64_t{0});
  team_for(0, count, [&](std::uint32_t shard) {
    const ShardNote note{shard_program(),  imported->input_hash, {shard}, count, true,
                         note_of(request_)};
    written[shard] = writer.write(paths_[shard], note);
  });
  for (const auto& shard : written) {
    if (!shard.ok()) return shard.error();
    bytes_ += *shard;
  }
  return {};
}

}  // namespace clamor::testing
