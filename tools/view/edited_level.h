// edited_level.h: a level whose acoustics are edited: materials, emitters, places to listen from,
// portals, and which of its nodes are movable parts.
//
// Edits change the sidecar, LEVEL.acoustics.json, and never the level. Beside its text a state
// keeps the values that follow from it, so that nothing is imported again for a display. Unsaved
// work is written to an autosave file beside the sidecar after every edit: a crash loses nothing,
// and a bake of the unsaved state reads it with --acoustics.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/material.h"
#include "common/result.h"
#include "formats/files/json.h"
#include "formats/gltf/import_options.h"
#include "formats/gltf/import_report.h"
#include "formats/level/emitter.h"
#include "formats/level/sidecar.h"

namespace clamor {

struct Level;
struct Mesh;
struct MovablePart;

struct LevelState {
  Json sidecar{Json::Object{}};
  std::shared_ptr<const Level> level;  // as it was imported last: its mesh and movable parts
  std::vector<NamedTriangles> nodes;   // of its mesh
  std::vector<Material> materials;     // as Level::materials
  std::vector<std::string> presets;    // by material; "" for values of its own
  std::vector<Emitter> emitters;
  std::vector<ListenerSpec> listeners;
  std::vector<PortalSpec> portals;  // those of the glTF scene, then those of the sidecar
};

// Undo and redo over immutable states.
//
// An edit is a new state. Edits of one gesture, such as the dragging of a slider, replace each
// other, so that one undo takes the gesture back.
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

class EditedLevel {
 public:
  // Imports the level as a bake would.
  static Result<EditedLevel> open(const std::string& path, const ImportOptions& options);

  const std::string& path() const { return path_; }
  const std::string& sidecar_path() const { return sidecar_path_; }
  const std::string& autosave_path() const { return autosave_path_; }
  // These change only when a node becomes a movable part or is one no longer.
  const Mesh& mesh() const;
  const std::vector<MovablePart>& parts() const;
  // In the world; all places here are relative to it, but for those in the sidecar.
  const Vec3& origin_m() const;
  // Hash of the level and its files as they were opened, as Provenance::input_hash.
  std::uint64_t input_hash() const { return input_hash_; }
  const LevelState& now() const { return history_.now(); }
  const EditHistory<LevelState>& history() const { return history_; }
  std::uint64_t revision() const { return revision_; }  // grows with every change of now()

  // `gesture`: edits with the same number, if it is not 0, are one step for undo().
  void set_material(std::size_t material, const Material& values, std::size_t gesture = 0);
  Result<void> set_preset(std::size_t material, const std::string& preset);

  // Why the emitter cannot be edited in a sidecar, or "".
  std::string why_fixed(std::size_t emitter) const;
  // Changes position, axis, gain or directivity.
  void set_emitter(std::size_t emitter, const Emitter& values, std::size_t gesture = 0);
  void remove_emitter(std::size_t emitter);
  // Adds an emitter with a new name; `signal` is "noise", "impulse" or a sound file in the level's
  // folder. Errors: as those of sound_of_level().
  Result<std::size_t> add_emitter(const std::string& signal, const Vec3& at_m, const Vec3& facing);

  void set_listener(std::size_t listener, const ListenerSpec& values, std::size_t gesture = 0);
  void add_listener(const ListenerSpec& values);
  void remove_listener(std::size_t listener);

  // Why a portal cannot be edited in a sidecar, or "".
  std::string why_portal_fixed(std::size_t portal) const;
  void set_portal(std::size_t portal, const PortalSpec& values, std::size_t gesture = 0);
  std::size_t add_portal(const PortalSpec& values);
  void remove_portal(std::size_t portal);

  // Makes movable parts of the nodes of this name, with all below them, or surfaces of the level
  // again. Imports the level, which takes as long as opening it. The Error leaves all as it is.
  Result<void> set_movable(const std::string& node, bool movable);
  // Why the nodes of a part cannot become surfaces again, or "".
  std::string why_movable_fixed(const std::string& node) const;

  void undo();
  void redo();

  // The text of the sidecar.
  std::string sidecar_text() const;
  bool is_saved() const;
  // Writes the sidecar and removes the autosave file.
  Result<void> save();
  // Writes the autosave file, or removes it if all is saved.
  Result<void> autosave();
  void discard_autosave();

  // Work that an earlier run did not save, if there is any.
  bool has_unsaved_work() const { return unsaved_.has_value(); }
  // Takes it over as one edit. The Error leaves everything as it is.
  Result<void> recover();

  // The options that a bake of now() needs: the sidecar, or the autosave file if it is not saved.
  ImportOptions import_options() const;

 private:
  EditedLevel(std::string path, ImportOptions options, LevelState first);

  void edit(LevelState next, const std::string& what, std::size_t gesture = 0);
  // Imports the level with another sidecar, as one edit, through the autosave file.
  Result<void> import_again(Json sidecar, const std::string& what);
  std::size_t portals_of_scene() const;

  std::string path_, sidecar_path_, autosave_path_;
  ImportOptions options_;
  EditHistory<LevelState> history_;
  std::string saved_text_;
  std::optional<std::string> unsaved_;  // text of an autosave file that was found
  std::uint64_t revision_ = 1, input_hash_ = 0;
};

}  // namespace clamor
