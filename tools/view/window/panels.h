// panels.h: the panels of the window: the toolbar, what is selected, what is heard, and meters.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/view/view_session.h"
#include "tools/view/voice_display.h"
#include "tools/view/window/theme.h"

namespace clamor {

// In pixels. The level fills what is left between the panels.
struct WindowLayout {
  float toolbar = 0, side = 0, bottom = 0;  // sizes of the panels
  float width = 0, height = 0, scale = 1;

  static WindowLayout of(float width, float height, float scale);
  float view_width() const { return width - side; }
  float view_height() const { return height - toolbar - bottom; }
  double aspect() const { return static_cast<double>(view_width() / view_height()); }
  // Where a point of the level is drawn; false if it is behind.
  bool place(const WalkCamera& camera, const Vec3& point_m, ImVec2& at) const;
};

class Panels {
 public:
  Panels(ViewSession& session, const Fonts& fonts) : session_(session), fonts_(fonts) {}

  void draw(const WindowLayout& layout, const VoiceDisplay& voices);

  // The user wants to leave: asks if there is unsaved work. wants_to_quit() tells the answer.
  void ask_to_quit();
  bool wants_to_quit() const { return quits_; }

  // Adds an emitter, or says why that cannot be.
  void add_emitter(const std::string& signal);

  // Keys of the window: Ctrl+S, Ctrl+Z, Ctrl+Shift+Z.
  void save();

 private:
  void draw_toolbar(const WindowLayout& layout);
  void draw_side(const WindowLayout& layout);
  void draw_bottom(const WindowLayout& layout, const VoiceDisplay& voices);
  void draw_marks(const WindowLayout& layout) const;
  void draw_message(const WindowLayout& layout) const;
  void draw_questions();

  // panels_lists.cpp
  void draw_edit();
  void draw_findings();
  void draw_lists();
  void draw_sound_files();

  // panels_edit.cpp
  void draw_surface();
  void draw_emitter();
  void draw_listener();
  bool draw_heading(const std::string& name) const;  // whether all shall be listed instead
  bool drag_place(Vec3& place_m) const;
  bool drag_direction(Vec3& direction) const;

  // panels_doors.cpp
  bool draw_doors();
  void draw_part();
  void draw_portals_of_part(std::size_t part);
  void draw_portal();
  void edit_portal(std::size_t index);
  bool edit_parts_of(std::size_t portal, PartPatterns& patterns);
  void draw_nodes();
  static bool drag_share(const char* label, double& share);

  // panels_listen.cpp
  void draw_listen();
  void draw_strategy();
  void draw_sound_parts();
  void draw_octaves();
  void draw_source_key() const;
  void draw_meters(float width, float height);
  void draw_figures(const VoiceDisplay& voices);
  void draw_spectrogram(float width, float height);

  std::size_t gesture();
  // Shows the Error of what was asked for, if there is one.
  void tell(const Result<void>& done) {
    if (!done.ok()) problem_ = done.error().message;
  }

  ViewSession& session_;
  const Fonts fonts_;
  float scale_ = 1;
  std::size_t gestures_ = 0;
  bool was_dragging_ = false;
  bool asked_to_recover_ = false, asks_to_quit_ = false, quits_ = false;
  std::string problem_;
  std::array<char, 512> sound_path_{};
  std::vector<std::string> sounds_;  // beside the level
  std::array<char, 128> portal_name_{};
  std::size_t portal_named_ = SIZE_MAX;
  std::vector<double> areas_m2_;  // by material
  std::uint64_t area_revision_ = 0;
  std::size_t polar_band_ = 4;  // 1 kHz
  int voices_wanted_ = 0;
  std::uint64_t held_blocks_ = 0;
  double late_until_s_ = 0, threads_due_s_ = 0;
  std::string threads_;
  std::array<bool, kBandCount> muted_{}, soloed_{};
  std::array<bool, kSoundParts> part_muted_{}, part_soloed_{};
  std::array<float, kMaxChannels> peaks_{};  // decaying
};

}  // namespace clamor
