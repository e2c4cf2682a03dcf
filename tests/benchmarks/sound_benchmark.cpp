// sound_benchmark.cpp: time of opening a level, and cost of streaming its sounds.
//
//   open/whole     every signal of a file decoded and prepared in advance
//   open/streamed  until the sounds of the first keyframe are loaded
//   piece          one loader thread, from the blocks of the file to what voices read, during
//                  playback
//
// The level has 13 loops of 10 s, like a stadium, and 2 of three minutes. Counters: seconds of
// sound per second of CPU time. Results are checked: the first output is not silent.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/page.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor {
namespace {

constexpr std::size_t kShort = 13, kLong = 2;
constexpr std::size_t kShort_frames = 10 * kSampleRate_hz, kLong_frames = 180 * kSampleRate_hz;

Signal noise(std::uint32_t seed, std::size_t frames) {
  Signal signal{"noise " + std::to_string(seed), {}, true};
  double last = 0;
  for (std::uint32_t i = 0; i < frames; ++i) {
    last = 0.9 * last + 0.1 * (unit(philox(seed, {i, 0, 0, 0})[0]) - 0.5);
    signal.samples.push_back(static_cast<float>(last));
  }
  return signal;
}

std::shared_ptr<const BakeFile> level() {
  static const auto kFile = [] {
    BakeContents contents;
    OctreeNode node;
    for (std::uint32_t s = 0; s < kShort + kLong; ++s) {
      contents.signals.push_back(noise(s, s < kShort ? kShort_frames : kLong_frames));
      Emitter& emitter = contents.emitters.emplace_back();
      emitter.name = "emitter " + std::to_string(s);
      emitter.position_m = {static_cast<double>(s), 0, 0};
      emitter.signal = s;
      emitter.delay_s = 0.37 * s;
      Source& source = contents.octree.sources.emplace_back();
      source.emitter = s;
      source.u = 0.5f;
      set_from_emitter(source, emitter);
      node.highest_key = 1000;
    }
    node.low_m = {-1, -1, -1};
    node.high_m = {100, 1, 1};
    node.max_delay_s = 100;
    node.source_count = static_cast<std::uint32_t>(contents.octree.sources.size());
    contents.octree.nodes = {node};
    const std::string path =
        (std::filesystem::temp_directory_path() / "clamor_sound_benchmark.clamor").string();
    const auto written = write_bake(path, contents, 2);
    auto file = BakeFile::open(path);
    if (!written.ok() || !file.ok()) std::abort();
    std::filesystem::remove(path);
    return std::make_shared<const BakeFile>(std::move(*file));
  }();
  return kFile;
}

bool is_heard(Auralizer& auralizer) {
  std::vector<float> block(2 * 9600);
  auralizer.mix(block);
  return std::any_of(block.begin(), block.end(), [](float x) { return std::abs(x) > 1e-4f; });
}

void BM_OpenWhole(benchmark::State& state) {
  const auto file = level();
  for (auto _ : state) {
    auto input = read_auralizer_input(*file);
    if (!input.ok()) std::abort();
    auto auralizer = Auralizer::create(std::move(*input), {});
    if (!auralizer.ok()) std::abort();
    (*auralizer)->make_keyframe({{5, 1, 1}, 0, 0});
    state.PauseTiming();
    if (!is_heard(**auralizer)) std::abort();
    auralizer->reset();
    state.ResumeTiming();
  }
}
BENCHMARK(BM_OpenWhole)->Name("open/whole")->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_OpenStreamed(benchmark::State& state) {
  const auto file = level();
  AuralizerOptions options;
  options.wait_for_pages = state.range(0) != 0;
  for (auto _ : state) {
    auto auralizer = Auralizer::create(file, options);
    if (!auralizer.ok()) std::abort();
    (*auralizer)->make_keyframe({{5, 1, 1}, 0, 0});
    state.PauseTiming();
    if (!is_heard(**auralizer)) std::abort();
    auralizer->reset();
    state.ResumeTiming();
  }
}
BENCHMARK(BM_OpenStreamed)
    ->Name("open/streamed")
    ->ArgName("all that is heard")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// Uses its own loader without threads.
void BM_Piece(benchmark::State& state) {
  const auto file = level();
  const auto kept = static_cast<std::size_t>(state.range(0));
  SignalBlockCache blocks(
      [&](std::size_t signal, std::size_t block) { return file->read_signal_block(signal, block); },
      kept);
  PreparedSignal signal(kLong_frames, true, {});
  signal.use_memory(std::make_shared<ReservedMemory>(signal.memory_bytes()), 0);
  std::size_t piece = 0;
  for (auto _ : state) {
    const PreparedSignal::Window window = signal.window(piece);
    auto samples = blocks.read(kShort, {kLong_frames, true}, window.first, window.frames);
    if (!samples.ok()) std::abort();
    signal.commit(piece);
    signal.make(piece, std::move(*samples));
    signal.decommit(piece);
    piece = (piece + 1) % (signal.pieces() - 1);
  }
  state.counters["real_time"] =
      benchmark::Counter(static_cast<double>(kPieceFrames) / kSampleRate_hz,
                         benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BM_Piece)
    ->Name("piece")
    ->ArgName("blocks kept")
    ->Arg(0)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
