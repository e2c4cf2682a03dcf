// auralizer.h: a bake file made audible: samples sources, makes keyframes, mixes them.
//
// One step, used alike by the real-time player and the offline render:
//
//   sampler thread:  while (auralizer.wants_keyframe())
//                      auralizer.make_keyframe(listener at auralizer.next_keyframe_time_s());
//   audio thread:    auralizer.mix(block);
//
// Keyframe n says how things are at sample n x kKeyframeFrames if none is late; the mixer slides
// gains and delays from each to the next. Keyframes travel through a bounded queue, in order, a few
// of them ahead of the mixer, so what is heard is a function of the listeners alone, never of how
// the threads were scheduled or how large the device's blocks are. If the mixer finds none, it
// holds the last one (and counts that). Keyframes made from then on are of so much later moments:
// time goes on, and what is heard does not stay behind where the listener is.
//
// A listener who is moved in real time (AuralizerOptions::tracks_head) is heard sooner: keyframes
// are made just in time (keyframe_lead.h), and turns of the head go past them to the mixer, by
// face().
//
// Crowds are chosen anew less often, up to kMaxKeyframesPerSample keyframes apart, as long as a
// voice fades; delays and gains of what is chosen follow the listener in each keyframe all the
// same.
#pragma once

#include <atomic>
#include <memory>
#include <span>

#include "common/listener.h"
#include "common/result.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class BakeFile;
class MovingSources;
struct AuralizerInput;
struct AuralizerOptions;
struct AuralizerStatistics;

class Auralizer {
 public:
  // Decodes the file's first page; other pages, and sounds, when they are needed, but for "all" and
  // the paper's strategies. Errors: bad file, unknown strategy, no sources.
  static Result<std::unique_ptr<Auralizer>> create(std::shared_ptr<const BakeFile> file,
                                                   const AuralizerOptions& options);
  // From sources that are in memory already.
  static Result<std::unique_ptr<Auralizer>> create(AuralizerInput input,
                                                   const AuralizerOptions& options);
  ~Auralizer();

  // Sampler thread. Keyframe 0 also mixes the 85 ms before time 0, so that sound that has always
  // been playing is there from the first frame on; until it is made, mix() gives silence. It waits
  // for the sounds that are heard first, but no longer than first_sounds_s.
  // Between wants_keyframe() and make_keyframe() the next one's time stays what it is.
  bool wants_keyframe() const;
  double next_keyframe_time_s() const;
  void make_keyframe(const Listener& listener);

  // How the listener's head is turned from now on, where `tracks_head` is asked for; the position
  // comes with keyframes. On any one thread.
  void face(const Listener& listener);

  // Sampler thread, or before there is one: once `*stop` is set, whatever keyframe is being made
  // ends early, with whatever was chosen so far. It must outlive the auralizer or be taken back.
  void stop_when(const std::atomic<bool>* stop);

  int channels() const noexcept REALTIME;

  // Audio thread. Adds nothing to `interleaved`, overwrites it: left, right, left, ... or what the
  // output's channels are, any number of frames. Costs about voices x frames.
  void mix(std::span<float> interleaved) noexcept REALTIME;

  // Any one thread.
  AuralizerStatistics statistics();

  // Sources that come, move and go, on the caller's thread; null unless `moving.max_sources` asks
  // for any.
  MovingSources* moving();

 private:
  struct State;
  static Result<void> check(const AuralizerOptions& options);
  explicit Auralizer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
