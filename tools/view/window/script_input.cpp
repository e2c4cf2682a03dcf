#include "tools/view/window/script_input.h"

#include <cctype>
#include <ostream>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "tools/view/window/controls.h"
#include "tools/view/window/keyboard.h"

namespace clamor {

namespace {

constexpr int kClickFrames = 3;  // over it, pressed, released

int key_of(const std::string& name) {
  if (name.size() == 1) return std::toupper(static_cast<unsigned char>(name[0]));
  constexpr std::pair<const char*, int> kNamed[] = {
      {"Up", GLFW_KEY_UP},       {"Down", GLFW_KEY_DOWN},        {"Left", GLFW_KEY_LEFT},
      {"Right", GLFW_KEY_RIGHT}, {"Tab", GLFW_KEY_TAB},          {"Escape", GLFW_KEY_ESCAPE},
      {"Enter", GLFW_KEY_ENTER}, {"Shift", GLFW_KEY_LEFT_SHIFT}, {"Ctrl", GLFW_KEY_LEFT_CONTROL}};
  for (const auto& [known, key] : kNamed)
    if (name == known) return key;
  return 0;
}

void print_sound(ViewSession& session, std::ostream& out) {
  fmt::print(out, "edit to sound {:.2f} s, playing {}, {} sources chosen\n",
             session.edit_to_sound_s(), session.plays_other() ? "B" : "A", session.heard().size());
  if (const auto& first = session.first_bake())
    fmt::print(out, "first bake {:.2f} s, {}, decay known to {:.2f} dB\n", first->seconds,
               first->is_reweighed ? "paths kept" : "traced anew: " + first->why_traced,
               first->decay_error_db);
}

void print_doors(ViewSession& session, std::ostream& out) {
  for (const LevelDoors::Door& part : session.doors().parts())
    fmt::print(out, "part '{}' moved {:.0f} %\n", part.name, 100 * part.share);
  for (std::size_t p = 0; p < session.portals().size(); ++p) {
    const LevelDoors::Door& portal = session.doors().portals()[p];
    if (session.parts_of(p).empty())
      fmt::print(out, "portal '{}' open {:.0f} %\n", portal.name, 100 * portal.share);
    for (const std::size_t part : session.parts_of(p))
      fmt::print(out, "portal '{}' opened by '{}'\n", portal.name, session.parts()[part].name);
  }
}

}  // namespace

bool ScriptInput::take_size(int& width, int& height) {
  if (!has_size_) return false;
  has_size_ = false;
  width = width_;
  height = height_;
  return true;
}

// Sets all keys of a chord as "Ctrl+Z".
Result<void> ScriptInput::set_key(const std::string& name, bool is_down) {
  for (std::size_t at = 0; at <= name.size();) {
    const std::size_t plus = std::min(name.find('+', at), name.size());
    const int key = key_of(name.substr(at, plus - at));
    if (key == 0) return Error("no key is called " + name.substr(at, plus - at));
    keys_[static_cast<std::size_t>(key)] = is_down;
    at = plus + 1;
  }
  return {};
}

Result<void> ScriptInput::play_events(ViewSession& session, std::ostream& out) {
  scroll_ = 0;
  typed_.clear();
  if (!tapped_.empty()) {
    (void)set_key(std::exchange(tapped_, ""), false);
    return {};
  }
  if (click_frames_ > 0) {
    --click_frames_;
    buttons_[static_cast<std::size_t>(click_button_)] = click_frames_ == 1;
    return {};
  }
  if (waits_frames_ > 0) {
    --waits_frames_;
    return {};
  }
  if (is_done() || Clock::now() < waits_until_) return {};
  const ViewEvent& event = events_[next_];
  const auto done = play(event, session, out);
  if (!done.ok())
    return Error(fmt::format("script, line {}: {}", event.line, done.error().message));
  if (*done) {
    ++next_;
    waits_since_.reset();
    return {};
  }
  if (!waits_since_) waits_since_ = Clock::now();
  if (Clock::now() - *waits_since_ >= std::chrono::duration<double>(event.x))
    return Error(fmt::format("script, line {}: it waited for {:g} s in vain", event.line, event.x));
  return {};
}

// An event of the bake may come in the frame after it has ended.
Result<bool> ScriptInput::wait_for_bake(const ViewSession& session) {
  constexpr int kIdleFrames = 10;
  const bool may_come = session.baking().is_busy || session.waits_for_sound();
  idle_frames_ = may_come || session.is_final() ? 0 : idle_frames_ + 1;
  if (idle_frames_ > kIdleFrames)
    return Error("no bake comes: nothing was edited or saved since the last one");
  return false;
}

Result<bool> ScriptInput::has_come(ViewEvent::Kind awaited, ViewSession& session) {
  using Kind = ViewEvent::Kind;
  const auto& newest = session.newest_bake();
  const bool failed = (newest && !newest->error.empty()) || !session.sound().error().empty();
  switch (awaited) {
    case Kind::kWaitSound:
      if (session.emitters().empty() && !session.sound().is_playing())
        return Error("the sound does not come: the level has no emitter");
      if (failed) return Error("the sound does not come: " + session.sound().error());
      return session.sound().is_playing() && session.sound().statistics().time_s > 0.2 &&
             !session.waits_for_sound();
    case Kind::kWaitQuick:
      if (failed) return Error("the bake has failed: " + (newest ? newest->error : ""));
      if (newest.has_value() && !session.waits_for_sound()) return true;
      return wait_for_bake(session);
    case Kind::kWaitFinal:
      if (failed) return Error("the bake has failed: " + (newest ? newest->error : ""));
      if (session.is_final() && !session.sound().is_opening()) return true;
      return wait_for_bake(session);
    default:  // kWaitRebaked
      if (failed) return Error("the sound does not come: " + session.sound().error());
      return session.followed() > 0 && !session.sound().is_opening();
  }
}

// Returns whether the event is over.
Result<bool> ScriptInput::play(const ViewEvent& event, ViewSession& session, std::ostream& out) {
  using Kind = ViewEvent::Kind;
  switch (event.kind) {
    case Kind::kSize:
      has_size_ = true;
      width_ = static_cast<int>(event.x);
      height_ = static_cast<int>(event.y);
      waits_frames_ = 3;
      return true;
    case Kind::kMove:
      mouse_ = {static_cast<float>(event.x), static_cast<float>(event.y)};
      return true;
    case Kind::kMoveWorld:
      world_m_ = {event.x, event.y, event.z};
      wants_place_ = true;
      return true;
    case Kind::kMoveTo:
      if (!control_places().contains(event.text))
        return Error("no control is called '" + event.text + "' now");
      mouse_ = control_places().at(event.text);
      return true;
    case Kind::kPress:
      buttons_[0] = true;
      return true;
    case Kind::kRelease:
      buttons_[0] = false;
      return true;
    case Kind::kClick:
    case Kind::kRightClick:
      click_button_ = event.kind == Kind::kClick ? 0 : 1;
      click_frames_ = kClickFrames;
      return true;
    case Kind::kScroll:
      scroll_ = static_cast<float>(event.x);
      return true;
    case Kind::kKeyDown:
    case Kind::kKeyUp:
      if (const auto set = set_key(event.text, event.kind == Kind::kKeyDown); !set.ok())
        return set.error();
      return true;
    case Kind::kKey:
      if (const auto set = set_key(event.text, true); !set.ok()) return set.error();
      tapped_ = event.text;
      return true;
    case Kind::kType:
      typed_ = event.text;
      return true;
    case Kind::kDrop:
      dropped_ = event.text;
      return true;
    case Kind::kWaitFrames:
      waits_frames_ = static_cast<int>(event.x);
      return true;
    case Kind::kWaitSeconds:
      waits_until_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1000 * event.x));
      return true;
    case Kind::kWaitSound:
    case Kind::kWaitQuick:
    case Kind::kWaitFinal:
    case Kind::kWaitRebaked:
      return has_come(event.kind, session);
    case Kind::kScreenshot:
      screenshot_ = event.text;
      return true;
    case Kind::kPrint:
      print_sound(session, out);
      return true;
    case Kind::kPrintDoors:
      print_doors(session, out);
      return true;
    case Kind::kQuit:
      quits_ = true;
      return true;
  }
  return true;
}

void ScriptInput::apply() const {
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = mouse_;
  io.MouseDown[0] = buttons_[0];
  io.MouseDown[1] = buttons_[1];
  io.MouseWheel = scroll_;
  set_keys(keys_);
  for (const char c : typed_) io.AddInputCharacter(static_cast<unsigned char>(c));
}

}  // namespace clamor
