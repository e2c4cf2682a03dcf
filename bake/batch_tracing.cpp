#include "bake/batch_tracing.h"

#include <memory>
#include <utility>

#include "common/thread_team.h"

namespace clamor {

namespace {

// The batches of a shard. A whole run goes to a shard that depends on the run alone, so that a
// shard finds it in its journal when a larger bake continues this one.
std::vector<std::vector<PhotonRun>> batches_of(const BakePlan& plan, const Shard& shard) {
  auto all = plan.batches();
  if (shard.count == 1) return all;
  std::vector<std::vector<PhotonRun>> mine;
  std::uint64_t others = 0;
  for (auto& batch : all) {
    const PhotonRun& run = batch.front();
    const std::uint64_t place =
        run.count == kRunPhotons ? run.emitter + run.first / kRunPhotons : others++;
    if (place % shard.count == shard.index) mine.push_back(std::move(batch));
  }
  return mine;
}

bool before(const PhotonRun& a, const PhotonRun& b) {
  return a.emitter != b.emitter ? a.emitter < b.emitter : a.first < b.first;
}

}  // namespace

// A batch in the pipeline.
struct BatchTracing::Batch {
  std::size_t index = 0;
  std::vector<PhotonRun> missing;
  TracedRuns found, traced;
  DecayEnergies received_found, received_traced;
};

BatchTracing::BatchTracing(const PhotonTracer& tracer, const BakePlan& plan,
                           const BakeOptions& options, RunSource& source, const Shard& shard,
                           DecayEstimate* decay, RunSink sink)
    : tracer_(tracer),
      plan_(plan),
      options_(options),
      source_(source),
      decay_(decay),
      sink_(std::move(sink)),
      batches_(batches_of(plan, shard)),
      portals_(plan.photons.size()) {
  if (shard.count == 1 && !sink_)
    thinning_.emplace(plan.sources, DepositWeight(tracer.settings().decay), tracer.speed_mps());
  progress_.stage = "tracing";
  for (const auto& batch : batches_)
    for (const PhotonRun& run : batch) progress_.photons_total += run.count;
}

Result<void> BatchTracing::thin_in_file(const std::string& beside) {
  return thinning_ ? thinning_->use_file(beside) : Result<void>();
}

Result<BatchTracing::Output> BatchTracing::run() {
  const std::size_t at_once = 4 * static_cast<std::size_t>(team_size());
  std::vector<std::unique_ptr<Batch>> free;
  for (std::size_t i = 0; i < at_once; ++i) free.push_back(std::make_unique<Batch>());
  std::mutex free_mutex;
  std::size_t next = 0;
  const auto first_stage = [&]() -> Batch* {
    if (next == batches_.size() || stopped() || failed_) return nullptr;
    Batch* batch = nullptr;
    {
      const std::lock_guard lock(free_mutex);
      batch = free.back().release();
      free.pop_back();
    }
    batch->index = next++;
    look_up(*batch);
    return batch;
  };
  const auto parallel_stage = [&](Batch* batch) {
    if (stopped()) return;
    tracer_.trace(batch->missing, batch->traced);
    batch->received_found = measure_decay(batch->found);
    batch->received_traced = measure_decay(batch->traced);
  };
  const auto last_stage = [&](Batch* batch) {
    accumulate(*batch);
    const std::lock_guard lock(free_mutex);
    free.emplace_back(batch);
  };
  team_pipeline<Batch>(at_once, first_stage, parallel_stage, last_stage);
  if (failed_) return Error(failure_);
  if (stopped()) return Error("stopped");
  Output output;
  if (thinning_) {
    output.deposits = thinning_->added();
    output.sources = thinning_->take();
    output.portals = std::move(portals_);
  }
  output.tally = tally_;
  output.progress = progress_;
  output.power_arrived = std::move(power_arrived_);
  return output;
}

// Stages may fail at the same time; the first failure counts.
void BatchTracing::fail(std::string message) {
  if (!failed_.exchange(true)) failure_ = std::move(message);
}

void BatchTracing::look_up(Batch& batch) {
  batch.missing.clear();
  batch.found.clear();
  batch.traced.clear();
  const std::lock_guard lock(source_mutex_);
  if (source_.records_paths()) batch.traced.record_paths();
  for (const PhotonRun& run : batches_[batch.index]) {
    const auto has = source_.find(run, batch.found);
    if (!has.ok()) return fail(has.error().message);
    if (!*has) batch.missing.push_back(run);
  }
}

BatchTracing::DecayEnergies BatchTracing::measure_decay(const TracedRuns& runs) const {
  DecayEnergies received(runs.runs().size());
  for (std::size_t i = 0; i < received.size(); ++i)
    if (const TracedRun& run = runs.runs()[i]; decay_ != nullptr && decay_->wants(run.run))
      decay_->receive(runs.deposits_of(run), received[i]);
  return received;
}

void BatchTracing::accumulate(Batch& batch) {
  if (stopped() || failed_) return;
  {
    const std::lock_guard lock(source_mutex_);
    if (const auto recorded = source_.record(batch.traced); !recorded.ok())
      return fail(recorded.error().message);
  }

  // Merges found and traced runs in the order of emitters and photons.
  const auto found = batch.found.runs(), traced = batch.traced.runs();
  for (std::size_t f = 0, t = 0; f < found.size() || t < traced.size();) {
    if (t == traced.size() || (f < found.size() && before(found[f].run, traced[t].run))) {
      progress_.photons_reused += found[f].tally.photons;
      accumulate_run(found[f], batch.found.deposits_of(found[f]), batch.received_found[f]);
      ++f;
    } else {
      progress_.bounces += traced[t].tally.bounces;
      accumulate_run(traced[t], batch.traced.deposits_of(traced[t]), batch.received_traced[t]);
      ++t;
    }
  }
  if (decay_ != nullptr && !source_.is_instant() && progress_.photons_done >= next_error_) {
    progress_.error_db = decay_->error_db().value_or(0);
    next_error_ = progress_.photons_done + progress_.photons_done / 8;
    if (progress_.error_db > 0) {
      const std::lock_guard lock(source_mutex_);
      source_.set_error_db(progress_.error_db);
    }
  }
  if (options_.on_progress) options_.on_progress(progress_);
}

void BatchTracing::accumulate_run(const TracedRun& run, std::span<const Deposit> deposits,
                                  std::span<const ReceivedEnergy> received) {
  if (decay_ != nullptr && decay_->wants(run.run)) decay_->add(run.run, received);
  const double photon_share = 1 / static_cast<double>(plan_.photons[run.run.emitter]);
  if (thinning_) {
    sources_.clear();
    for (const Deposit& deposit : deposits) {
      Source& source = sources_.emplace_back(secondary_source(deposit, photon_share));
      source.emitter = portals_.number_of(deposit.emitter, deposit.portals);
    }
    thinning_->add(sources_, tracer_.deposit_threshold(run.run.emitter) * photon_share);
  }
  if (sink_) sink_(run, deposits);
  tally_.add(run.tally, photon_share);
  for (const ArrivedPower& arrived : run.arrived) {
    if (arrived.material >= power_arrived_.size()) power_arrived_.resize(arrived.material + 1u);
    for (std::size_t b = 0; b < kBandCount; ++b)
      power_arrived_[arrived.material][b] += static_cast<double>(arrived.power[b]) * photon_share;
  }
  progress_.photons_done += run.tally.photons;
  progress_.escaped += run.tally.escaped;
}

}  // namespace clamor
