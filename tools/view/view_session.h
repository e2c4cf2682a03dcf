// view_session.h: what the window shows and edits, without the window: a level or a bake, the
// listener, the selection, doors, the bakes in the background, and the sound.
//
//   ViewSession::open() -> every frame: input() and frame() -> the window draws it
//
// An edit is followed by an autosave at once and, when no further edit comes for a moment, by a
// progressive bake, whose stages are played as they come.
//
// Threads: one.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bake/bake_request.h"
#include "formats/bake_file/level_findings.h"
#include "formats/level/mesh.h"
#include "tools/program/bake_file_watcher.h"
#include "tools/strategies/strategies.h"
#include "tools/view/edited_level.h"
#include "tools/view/level_doors.h"
#include "tools/view/level_shapes.h"
#include "tools/view/live_sound.h"
#include "tools/view/progressive_bake.h"
#include "tools/view/walk_camera.h"

namespace clamor {

struct ViewOptions {
  std::string path;     // a level or a bake
  BakeRequest request;  // for the level; level_path is set by the session
  // Tells what made a bake, if its level lies beside it: that of `path`, and each that replaces it.
  std::function<std::optional<BakeRequest>(const BakeFile&)> made_by;
  std::string output;   // for the bake of the saved level; "": none
  std::string compare;  // another bake; "": none
  PlayerOptions player;
  std::optional<Listener> listener;  // at the start
  std::optional<Vec3> at_m;          // a place to look at, and to mark, at the start
  StrategyOptions strategy;
  FileAccess access = FileAccess::kRead;
  int threads = 0;
};

inline constexpr std::uint32_t kNoTriangle = 0xffffffff;  // of a material that is selected alone

struct Selection {
  enum class Kind { kNone, kSurface, kEmitter, kListener, kPart, kPortal };
  Kind kind = Kind::kNone;
  std::size_t index = 0;       // material, emitter, listener, part or portal
  std::uint32_t triangle = 0;  // of a surface, or kNoTriangle
  bool operator==(const Selection&) const = default;
};

// A place that the window marks.
struct PlaceMark {
  Vec3 place_m{};
  std::string title;
  LevelFinding::Kind kind = LevelFinding::Kind::kFact;
};

class ViewSession {
 public:
  static Result<std::unique_ptr<ViewSession>> open(ViewOptions options);

  // Moves the listener and takes over what the background has finished.
  void frame(const WalkKeys& keys, double seconds);

  bool is_editable() const { return level_.has_value(); }
  EditedLevel& level() { return *level_; }
  const std::string& why_not_editable() const { return why_not_editable_; }

  const std::string& title() const { return title_; }
  const Mesh& mesh() const { return mesh_; }
  // In the world; all places of the session are relative to it.
  const Vec3& origin_m() const { return origin_m_; }
  const std::vector<ShadedVertex>& vertices() const { return vertices_; }
  // Grows when mesh() and vertices() change, because the bake that was opened was baked again.
  std::uint64_t shape_revision() const { return shape_revision_; }
  // How often the bake that was opened was replaced by another one.
  int followed() const { return followed_; }
  const std::vector<Material>& materials() const { return shown().materials; }
  const std::vector<Emitter>& emitters() const { return shown().emitters; }
  const std::vector<ListenerSpec>& listeners() const { return shown().listeners; }
  const std::vector<MovablePart>& parts() const;
  const std::vector<Portal>& portals() const { return portals_; }
  std::vector<std::size_t> parts_of(std::size_t portal) const;  // that open and close it
  WalkCamera& camera() { return camera_; }
  const WalkCamera& camera() const { return camera_; }

  // Selects what lies under a point of the picture, each coordinate from 0 to 1.
  void select_at(double x, double y, double aspect);
  void select(const Selection& selection);
  const Selection& selection() const { return selection_; }
  const std::vector<Vec3f>& outline() const { return outline_; }  // of the selected surface
  const std::vector<std::uint32_t>& surface() const { return surface_; }

  // Doors: movable parts where they are now, and how open portals are.
  LevelDoors& doors() { return doors_; }
  const LevelDoors& doors() const { return doors_; }
  const std::vector<ShadedVertex>& part_vertices() const { return part_vertices_; }
  Mesh part_mesh(std::size_t part) const;
  const Vec3& part_middle_m(std::size_t part) const { return part_middles_m_[part]; }
  std::uint64_t door_revision() const { return door_revision_; }  // grows when they move or change
  // Whether a selected part has left its place, or a portal is more open than closed.
  bool is_open(const Selection& door) const;
  void set_open(const Selection& door, bool open);
  // Opens or closes the selected door, or the nearest one ahead within 5 m.
  void toggle_door();
  // Adds a portal in the doorway that the listener looks through, or one of a door's usual size
  // ahead of him, or the one that a part fills; and selects it.
  Result<void> add_portal(std::optional<std::size_t> of_part = std::nullopt);
  // Calls EditedLevel::set_movable(). Selects the new part.
  Result<void> set_movable(const std::string& node, bool movable);
  // The nodes that a triangle belongs to, from that of its mesh upwards; none without a level.
  std::vector<std::string> nodes_of(std::uint32_t triangle) const;

  // Findings of the bake that plays about its level.
  const std::vector<LevelFinding>& findings() const { return findings_; }
  // The cause of booming or ringing in the room of that bake, as a sentence; "" if there is none.
  const std::string& cause_of_decay() const { return cause_of_decay_; }
  // T30 of that bake, 0 in octaves where it is not known.
  const Bands& t30_s() const { return t30_s_; }
  // Moves the camera to where the place of a finding is seen, and marks it.
  void show(const LevelFinding& finding);
  const std::optional<PlaceMark>& mark() const { return mark_; }
  void remove_mark() { mark_.reset(); }

  LiveSound& sound() { return *sound_; }
  const std::vector<HeardSource>& heard() const { return heard_; }
  const StrategyOptions& strategy() const { return strategy_; }
  // The Error leaves the strategy as it was.
  Result<void> set_strategy(const StrategyOptions& strategy);

  // A is what is edited or was opened, B the other bake.
  bool has_other() const { return !options_.compare.empty(); }
  bool plays_other() const { return plays_other_; }
  void set_plays_other(bool other);

  ProgressiveBake::Status baking() const {
    return bake_ ? bake_->status() : ProgressiveBake::Status();
  }
  const std::optional<ProgressiveBake::Event>& newest_bake() const { return newest_; }
  bool is_final() const { return newest_ && newest_->is_final && newest_->error.empty(); }
  // From the last edit to the moment when the first bake of it is handed to the audio thread; 0
  // before the first.
  double edit_to_sound_s() const { return edit_to_sound_s_; }
  // The first bake of the last edit, once it is there.
  const std::optional<ProgressiveBake::Event>& first_bake() const { return first_; }
  // Whether the last edit is not heard yet.
  bool waits_for_sound() const {
    return waits_for_sound_ || (level_ && level_->revision() != baked_revision_);
  }

  // Adds an emitter in front of the listener, facing it, and selects it; `signal` as for
  // EditedLevel::add_emitter().
  Result<void> add_emitter(const std::string& signal);

  void undo();
  void redo();
  // Saves the sidecar, and bakes the saved level to the output.
  Result<void> save();
  Result<void> recover();

  // A line for people about the last thing that happened; empty if nothing did.
  const std::string& message() const { return message_; }
  void say(std::string message) { message_ = std::move(message); }

 private:
  using Clock = std::chrono::steady_clock;

  explicit ViewSession(ViewOptions options) : options_(std::move(options)) {}
  const LevelState& shown() const { return level_ ? level_->now() : baked_; }
  Result<void> start_baking();
  Result<void> open_bake();
  Result<void> take_level_of(const BakeFile& file);
  Result<void> open_level();
  void follow_edits();
  void follow_file();
  void take_events();
  void take_findings();
  void check_selection();
  void take_shape();
  void take_doors();
  void move_doors(double seconds);
  bool plays_last_edit() const;
  Listener viewpoint(const Vec3& place_m, double size_m) const;
  void set_origin(const Vec3& origin_m);
  void bake_now(bool only_last = false);

  const ViewOptions options_;
  std::string title_, why_not_editable_, message_;
  BakeRequest request_;
  std::optional<EditedLevel> level_;
  Mesh mesh_;
  Vec3 origin_m_{};
  std::vector<Vec3f> colours_;  // of materials
  std::vector<ShadedVertex> vertices_;
  std::shared_ptr<const Level> shown_level_;  // that mesh_ is of; null: of a bake
  LevelDoors doors_;
  std::vector<Portal> portals_;
  std::vector<ShadedVertex> part_vertices_;
  std::vector<Vec3> part_middles_m_;
  std::uint64_t door_revision_ = 0;
  LevelState baked_;  // without a level
  std::vector<MovablePart> baked_parts_;
  WalkCamera camera_;
  Selection selection_;
  std::vector<Vec3f> outline_;
  std::vector<std::uint32_t> surface_;
  std::shared_ptr<const BakeFile> findings_of_;
  std::vector<LevelFinding> findings_;
  std::string cause_of_decay_;
  Bands t30_s_{};
  std::optional<PlaceMark> mark_;
  StrategyOptions strategy_;
  std::unique_ptr<ProgressiveBake> bake_;
  std::unique_ptr<LiveSound> sound_;
  std::vector<HeardSource> heard_;
  std::optional<ProgressiveBake::Event> newest_, first_;
  std::string own_path_;                    // the newest bake of A
  std::optional<BakeFileWatcher> watcher_;  // of the bake that was opened
  Clock::time_point checked_{};
  bool plays_other_ = false, saves_output_ = false;
  std::uint64_t shape_revision_ = 0;
  int followed_ = 0;
  std::uint64_t seen_revision_ = 0, baked_revision_ = 0, baked_request_ = 0;
  Clock::time_point edited_{};
  bool waits_for_sound_ = false;
  double edit_to_sound_s_ = 0;
};

}  // namespace clamor
