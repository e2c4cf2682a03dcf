// script_input.h: plays the events of a script into the input of Dear ImGui, in place of a person.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include <imgui.h>

#include "common/result.h"
#include "tools/view/view_script.h"
#include "tools/view/view_session.h"

namespace clamor {

class ScriptInput {
 public:
  explicit ScriptInput(const std::vector<ViewEvent>& events) : events_(events) {}

  bool is_active() const { return !events_.empty(); }
  bool is_done() const { return next_ >= events_.size(); }
  // Consumed by the window.
  std::string take_screenshot() { return std::exchange(screenshot_, ""); }
  std::string take_dropped() { return std::exchange(dropped_, ""); }
  bool wants_to_quit() const { return quits_; }
  bool take_size(int& width, int& height);

  // Call between the new frames of the backend and of Dear ImGui. `place` tells where a point of
  // the level is drawn. The Error is an event that cannot be.
  template <class Place>
  Result<void> frame(ViewSession& session, std::ostream& out, const Place& place) {
    const auto moved = play_events(session, out);
    if (!moved.ok()) return moved;
    if (wants_place_) {
      wants_place_ = false;
      if (!place(world_m_, mouse_))
        return Error("a script moves the mouse to a point that is not in view");
    }
    apply();
    return {};
  }

 private:
  using Clock = std::chrono::steady_clock;

  Result<void> play_events(ViewSession& session, std::ostream& out);
  // Whether what a script waits for is there; an Error if it will not come.
  Result<bool> has_come(ViewEvent::Kind awaited, ViewSession& session);
  Result<bool> play(const ViewEvent& event, ViewSession& session, std::ostream& out);
  Result<bool> wait_for_bake(const ViewSession& session);
  Result<void> set_key(const std::string& name, bool is_down);
  void apply() const;

  const std::vector<ViewEvent>& events_;
  std::size_t next_ = 0;
  int waits_frames_ = 0, idle_frames_ = 0;
  Clock::time_point waits_until_{};
  std::optional<Clock::time_point> waits_since_;  // for what the event waits for
  ImVec2 mouse_{-1, -1};
  std::array<bool, 2> buttons_{};
  int click_frames_ = 0;  // of a click in progress
  int click_button_ = 0;
  std::array<bool, 512> keys_{};
  std::string tapped_;  // a key that is released in the next frame
  float scroll_ = 0;
  std::string typed_, screenshot_, dropped_;
  bool quits_ = false, wants_place_ = false, has_size_ = false;
  int width_ = 0, height_ = 0;
  Vec3 world_m_{};
};

}  // namespace clamor
