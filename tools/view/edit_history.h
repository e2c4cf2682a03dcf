// edit_history.h: undo and redo over immutable states.
//
// An edit is a new state. Edits of one gesture, such as the dragging of a slider, replace each
// other, so that one undo takes the gesture back.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace clamor {

template <class State>
class EditHistory {
 public:
  explicit EditHistory(State first) { add(std::move(first), ""); }

  const State& now() const { return *states_[at_].state; }

  // `what` names the edit, as in "absorption of brick". An edit of the same gesture, if that is not
  // 0, replaces the last one. Forgets what could be redone.
  void edit(State next, std::string what, std::size_t gesture = 0) {
    states_.resize(at_ + 1);
    if (gesture != 0 && states_.back().gesture == gesture) states_.pop_back();
    add(std::move(next), std::move(what), gesture);
    if (states_.size() > kMost) states_.erase(states_.begin());
    at_ = states_.size() - 1;
  }

  bool can_undo() const { return at_ > 0; }
  bool can_redo() const { return at_ + 1 < states_.size(); }
  // Names of the edits that undo() takes back and redo() makes again; "" if there are none.
  std::string to_undo() const { return can_undo() ? states_[at_].what : ""; }
  std::string to_redo() const { return can_redo() ? states_[at_ + 1].what : ""; }
  void undo() {
    if (can_undo()) --at_;
  }
  void redo() {
    if (can_redo()) ++at_;
  }

 private:
  static constexpr std::size_t kMost = 1000;

  struct Entry {
    std::shared_ptr<const State> state;
    std::string what;  // the edit that led to it
    std::size_t gesture = 0;
  };

  void add(State state, std::string what, std::size_t gesture = 0) {
    states_.push_back({std::make_shared<const State>(std::move(state)), std::move(what), gesture});
  }

  std::vector<Entry> states_;
  std::size_t at_ = 0;
};

}  // namespace clamor
