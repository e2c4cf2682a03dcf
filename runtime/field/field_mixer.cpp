#include "runtime/field/field_mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>
#include <utility>

#include "runtime/field/field_kernel.h"

namespace clamor {

namespace {

constexpr int kBlock_frames = static_cast<int>(kHighField.partition);

}  // namespace

FieldMixer::FieldMixer(PlayableSignals signals, int pairs)
    : signals_(signals),
      high_(kHighField.transform, kLanes),
      low_(kLowField.transform, kLanes),
      work_(2),
      spectra_(kLanes),
      window_(kHighField.transform) {
  for (Part& part : parts_) part.pairs.resize(static_cast<std::size_t>(pairs));
}

FieldMixer::Roles FieldMixer::Part::partitions() const noexcept REALTIME {
  if (to == nullptr) return {};
  const std::span all(to->partitions);
  if (from == nullptr) return {{{}, {}, all}};
  if (to->number != from->number + 1) return {{from->partitions, all, {}}};
  return {{to->replaced, all.first(to->new_partitions), all.subspan(to->new_partitions)}};
}

template <class Visit>
void FieldMixer::for_inputs(const Visit& visit) const noexcept REALTIME {
  for (const Part& part : parts_)
    for (const FieldResponse* const response : {part.from, part.to}) {
      if (response == nullptr) continue;
      const FieldInput* last = nullptr;
      for (const FieldPartition& one : response->partitions) {
        if (one.input == last) continue;
        last = one.input;
        visit(*one.input);
      }
    }
}

void FieldMixer::begin(const FieldUpdate& update, std::int64_t read_frame, int played_frames) {
  first_frame_ = read_frame - played_frames;
  block_ = 0;
  for (std::size_t p = 0; p < kFieldParts; ++p) {
    parts_[p].to = update[p];
    parts_[p].from = nullptr;
  }
  begin_block();
  work_to(progress_.cost);
  end_block();
  played_frames_ = played_frames;
}

void FieldMixer::load(const FieldUpdate& update) noexcept REALTIME {
  for (std::size_t p = 0; p < kFieldParts; ++p) {
    if (update[p] == nullptr) continue;
    release(parts_[p].next);  // which had no time to begin
    parts_[p].next = update[p];
  }
}

// Decides what is heard in the next block.
void FieldMixer::begin_block() noexcept REALTIME {
  progress_ = {.has_begun = true};
  for (Part& part : parts_) {
    if (part.from != nullptr && part.faded_blocks >= part.to->fade_blocks) release(part.from);
    if (part.from == nullptr && part.next != nullptr) {
      part.from = std::exchange(part.to, std::exchange(part.next, nullptr));
      part.faded_blocks = 0;
    }
    for (const auto& some : part.partitions()) progress_.cost += some.size();
    progress_.cost += kOutputCost * part.pairs.size();
  }
  for_inputs([this](FieldInput& input) noexcept REALTIME {
    const auto kept = static_cast<std::int64_t>(input.blocks.size());
    input.next_block = std::max(input.next_block, block_ + 1 - kept);
    if (input.next_block <= block_)
      progress_.cost += kWindowCost * static_cast<std::size_t>(block_ + 1 - input.next_block);
  });
}

void FieldMixer::work_to(std::size_t cost) noexcept REALTIME {
  while (progress_.done < cost)
    if (!work_on()) return;
}

// Windows first, which are looked for once. False if nothing is left to do.
bool FieldMixer::work_on() noexcept REALTIME {
  if (progress_.lacks_windows) {
    progress_.lacks_windows = make_windows();
    return true;
  }
  return multiply_next();
}

// Transforms the next few windows that are missing. False if none are.
bool FieldMixer::make_windows() noexcept REALTIME {
  std::array<Wanted, kLanes> wanted;
  std::size_t count = 0;
  for_inputs([&](FieldInput& input) noexcept REALTIME {
    while (count < kLanes && input.next_block <= block_)
      wanted[count++] = {&input, input.next_block++};
  });
  if (count == 0) return false;
  transform(wanted, count);
  progress_.done += count * kWindowCost;
  return true;
}

// Reads both layers of a window to a lane. False if it is silent.
bool FieldMixer::read(const Wanted& wanted, std::size_t lane) noexcept REALTIME {
  const PreparedSignal& signal = signals_[wanted.input->signal];
  const std::int64_t begins =
      first_frame_ + (wanted.block - 1) * kBlock_frames - wanted.input->start_frames;
  constexpr auto kHighMargin = static_cast<std::int64_t>(kHighField.margin);
  constexpr auto kLowMargin = static_cast<std::int64_t>(kLowRate * kLowField.margin);
  constexpr auto kLowWindow = static_cast<std::int64_t>(kLowRate * kLowField.transform);
  if (signal.streams() &&
      !signal.is_resident(begins - kLowMargin, begins - kLowMargin + kLowWindow)) {
    late_blocks_ += !signal.is_live() || wanted.block == block_ ? 1 : 0;  // not what is long past
    return false;
  }
  bool sounds = false;
  const auto to_lane = [&](std::span<const float> samples, float* lanes) noexcept REALTIME {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      lanes[i * kLanes + lane] = samples[i];
      sounds = sounds || samples[i] != 0;
    }
  };
  signal.read_high(begins - kHighMargin, window_);
  to_lane(window_, work_[0].real.data());
  const auto low = std::span(window_).first(kLowField.transform);
  signal.read_low(begins - kLowMargin, low);
  to_lane(low, work_[1].real.data());
  return sounds;
}

void FieldMixer::transform(const std::array<Wanted, kLanes>& wanted,
                           std::size_t count) noexcept REALTIME {
  for (Work& work : work_) {
    work.real.fill(0);
    work.imaginary.fill(0);
  }
  std::array<FieldSpectrum*, kLanes> spectra{};
  for (std::size_t lane = 0; lane < count; ++lane) {
    FieldInput& input = *wanted[lane].input;
    const std::size_t place = input.place_of(wanted[lane].block);
    input.silent[place] = !read(wanted[lane], lane);
    if (input.silent[place] == 0) spectra[lane] = &input.blocks[place];
  }
  const auto put_in = [&](const LaneFourier& fourier, Work& work, auto layer_of) noexcept REALTIME {
    fourier.forward(work.real.data(), work.imaginary.data());
    const std::size_t points = fourier.size();
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (spectra[lane] == nullptr) continue;
      float* const to = layer_of(spectra_[lane]);
      for (std::size_t i = 0; i < points; ++i) {
        to[i] = work.real[i * kLanes + lane];
        to[points + i] = work.imaginary[i * kLanes + lane];
      }
    }
  };
  put_in(high_, work_[0], [](FieldSums& all) noexcept REALTIME { return all.high.data(); });
  put_in(low_, work_[1], [](FieldSums& all) noexcept REALTIME { return all.low.data(); });
  for (std::size_t lane = 0; lane < count; ++lane)
    if (spectra[lane] != nullptr) pack(spectra_[lane], *spectra[lane]);
}

// Multiplies the next partitions, or puts out a part whose partitions are all done. False if no
// part is left.
bool FieldMixer::multiply_next() noexcept REALTIME {
  if (progress_.part == kFieldParts) return false;
  Part& part = parts_[progress_.part];
  if (const Roles roles = part.partitions(); progress_.role < roles.size()) {
    const std::span some = roles[progress_.role];
    if (progress_.partition == some.size()) {
      ++progress_.role;
      progress_.partition = 0;
      return true;
    }
    multiply(some, part.pairs);
    return true;
  }
  output(part, part.pairs[progress_.pair]);
  progress_.done += kOutputCost;
  if (++progress_.pair < part.pairs.size()) return true;
  progress_.role = progress_.partition = progress_.pair = 0;
  ++progress_.part;
  return true;
}

// Multiplies the next few partitions of the same pair.
void FieldMixer::multiply(std::span<const FieldPartition> some,
                          std::span<Pair> pairs) noexcept REALTIME {
  std::array<SpectrumProduct, kProducts> products;
  std::size_t count = 0;
  const std::uint32_t pair = some[progress_.partition].pair;
  while (count < kProducts && progress_.partition < some.size() &&
         some[progress_.partition].pair == pair) {
    const FieldPartition& one = some[progress_.partition++];
    const std::size_t place = one.input->place_of(block_ - one.delay);
    if (one.input->silent[place] == 0)
      products[count++] = {&one.input->blocks[place], one.spectrum};
    ++progress_.done;
  }
  Pair& to = pairs[pair];
  FieldSums* const sums[] = {&to.sum_from, &to.sum_to, &to.sum_kept};
  multiply_add(std::span(products).first(count), *sums[progress_.role]);
}

// Transforms the sums back, four in the lanes of one: both responses with what both have, and what
// differs times the correction; and fades.
void FieldMixer::output(const Part& part, Pair& pair) noexcept REALTIME {
  Block& block = pair.blocks[1 - current_];
  block.is_silent = part.to == nullptr;
  if (block.is_silent) return;
  const bool fades = part.from != nullptr;
  const float whole = fades ? static_cast<float>(part.to->fade_blocks) : 1;
  const float begins = fades ? static_cast<float>(part.faded_blocks) / whole : 1;
  const float share = fades ? 1 / whole : 0;
  Work& work = work_[0];
  const auto put_out = [&](const LaneFourier& fourier, const FieldLayer& layer, auto layer_of,
                           const float* correction, auto& ears) noexcept REALTIME {
    const std::size_t points = layer.transform;
    for (std::size_t half = 0; half < 2; ++half) {
      float* const lanes = half == 0 ? work.real.data() : work.imaginary.data();
      float* const from = layer_of(pair.sum_from) + half * points;
      float* const to = layer_of(pair.sum_to) + half * points;
      float* const kept = layer_of(pair.sum_kept) + half * points;
      for (std::size_t i = 0; i < points; ++i) {
        lanes[i * kLanes] = from[i] + kept[i];
        lanes[i * kLanes + 1] = to[i] + kept[i];
        lanes[i * kLanes + 2] = correction[i] * from[i];
        lanes[i * kLanes + 3] = correction[i] * to[i];
      }
      for (float* const sum : {from, to, kept}) std::fill_n(sum, points, 0.0f);
    }
    fourier.inverse(work.real.data(), work.imaginary.data());
    const std::size_t first = (layer.partition + 2 * layer.margin) * kLanes;
    const float per_frame = share / static_cast<float>(layer.partition);
    for (std::size_t f = 0; f < layer.partition; ++f) {
      const float w = begins + per_frame * static_cast<float>(f), u = 1 - w;
      const float over = 1 / std::sqrt(w * w + u * u);
      const std::array<float, kLanes> weights{u, w, u * over - u, w * over - w};
      for (std::size_t e = 0; e < kEars; ++e) {
        const float* const y = (e == 0 ? work.real : work.imaginary).data() + first + f * kLanes;
        ears[e][f] = weights[0] * y[0] + weights[1] * y[1] + weights[2] * y[2] + weights[3] * y[3];
      }
    }
  };
  put_out(
      high_, kHighField, [](FieldSums& all) noexcept REALTIME { return all.high.data(); },
      part.to->correction_high.data(), block.high);
  put_out(
      low_, kLowField, [](FieldSums& all) noexcept REALTIME { return all.low.data(); },
      part.to->correction_low.data(), block.low);
}

void FieldMixer::end_block() noexcept REALTIME {
  for (Part& part : parts_) part.faded_blocks += part.from != nullptr;
  current_ = 1 - current_;
  played_frames_ = 0;
  ++block_;
  progress_.has_begun = false;
}

void FieldMixer::advance(int frames) noexcept REALTIME {
  assert(played_frames_ + frames <= kBlock_frames);
  if (!progress_.has_begun) begin_block();
  played_frames_ += frames;
  const auto played = static_cast<std::size_t>(played_frames_);
  work_to(progress_.cost * played / kHighField.partition);
  if (played_frames_ < kBlock_frames) return;
  while (work_on()) {
  }
  end_block();
}

void FieldMixer::add_to(MixBuses& buses, std::size_t pair, int frames) const noexcept REALTIME {
  const auto add = [](const float* samples, int count, float* row) noexcept REALTIME {
    for (int f = 0; f < count; ++f) row[f] += samples[f];
  };
  for (const Part& part : parts_) {
    const Block& block = part.pairs[pair].blocks[current_];
    if (block.is_silent) continue;
    for (int e = 0; e < kEars; ++e) {
      const auto ear = static_cast<std::size_t>(e);
      for (int b = 0; b < kHighBands; ++b)
        add(&block.high[ear][static_cast<std::size_t>(played_frames_)], frames,
            buses.high + (kEars * b + e) * kMaxFrames);
      for (int b = 0; b < kLowBands; ++b)
        add(&block.low[ear][static_cast<std::size_t>(played_frames_ / kLowRate)], frames / kLowRate,
            buses.low + (kEars * b + e) * (kMaxFrames / kLowRate));
    }
  }
}

void FieldMixer::add_powers(DiffuseHrtfEq& eq) const noexcept REALTIME {
  for (const Part& part : parts_)
    if (part.to != nullptr) eq.add(part.to->powers);
}

}  // namespace clamor
