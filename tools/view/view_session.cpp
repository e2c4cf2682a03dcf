#include "tools/view/view_session.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "common/utf8_path.h"
#include "formats/bake_file/baked_portals.h"

namespace clamor {

Result<std::unique_ptr<ViewSession>> ViewSession::open(ViewOptions options) {
  std::unique_ptr<ViewSession> session(new ViewSession(std::move(options)));
  const ViewOptions& wanted = session->options_;
  session->title_ = path_of(wanted.path).filename().string();
  session->strategy_ = wanted.strategy;
  const bool is_bake = path_of(wanted.path).extension() == ".clamor";
  if (auto opened = is_bake ? session->open_bake() : session->open_level(); !opened.ok())
    return opened.error();
  PlayerOptions player = wanted.player;
  const Vec3& origin_m = session->origin_m_;
  player.listener = in_front_of_first(session->emitters());
  if (wanted.listener) {
    player.listener = *wanted.listener;
    player.listener.position_m -= origin_m;
  }
  if (wanted.at_m) {
    const Vec3 at_m = *wanted.at_m - origin_m;
    player.listener = wanted.listener ? looking_at(player.listener.position_m, at_m)
                                      : session->viewpoint(at_m, 0);
    session->mark_ = PlaceMark{at_m, "here"};
  }
  session->camera_.place(player.listener);
  player.listener.position_m += origin_m;
  if (auto started = session->start_baking(); !started.ok()) return started.error();
  if (wanted.compare.empty() || BakeFile::open(wanted.compare, wanted.access).ok()) {
    session->sound_ = std::make_unique<LiveSound>(std::move(player), wanted.access);
  } else {
    return BakeFile::open(wanted.compare, wanted.access).error();
  }
  if (is_bake)
    session->sound_->play(session->own_path_, "A");
  else if (!session->emitters().empty())
    session->bake_now();
  return session;
}

// The camera stays where it is in the world.
void ViewSession::set_origin(const Vec3& origin_m) {
  if (origin_m == origin_m_) return;
  Listener at = camera_.listener();
  at.position_m += origin_m_ - origin_m;
  camera_.place(at);
  origin_m_ = origin_m;
}

// Starts the thread that bakes edits, unless it runs or nothing can be edited.
Result<void> ViewSession::start_baking() {
  if (bake_ || !is_editable()) return {};
  auto bake = std::make_unique<ProgressiveBake>(options_.threads);
  if (auto started = bake->start(); !started.ok()) return started;
  bake_ = std::move(bake);
  return {};
}

Result<void> ViewSession::open_bake() {
  const auto file = BakeFile::open(options_.path, options_.access);
  if (!file.ok()) return file.error();
  own_path_ = options_.path;
  watcher_.emplace(*file);
  return take_level_of(*file);
}

// Takes over what the window shows of a bake: its level to edit, if that lies beside it, or else
// the surfaces and emitters in the file.
Result<void> ViewSession::take_level_of(const BakeFile& file) {
  if (auto made_by = options_.made_by ? options_.made_by(file) : std::nullopt) {
    request_ = std::move(*made_by);
    if (request_.seed) request_.import.seed = *whole_number(*request_.seed);  // as LevelBake does
    if (auto level = EditedLevel::open(request_.level_path, request_.import); level.ok()) {
      level_ = std::move(*level);
      why_not_editable_.clear();
      take_shape();
      seen_revision_ = baked_revision_ = level_->revision();
      if (level_->input_hash() != file.provenance().input_hash)
        say(request_.level_path + " or its sidecar has changed since " + options_.path +
            " was baked: the bake is heard, the level as it is now is shown and edited.");
      return {};
    } else {
      why_not_editable_ = level.error().message;
    }
  } else {
    why_not_editable_ =
        "To edit, open the level: " + file.provenance().level + " does not lie beside the bake.";
  }
  auto mesh = file.read_mesh();
  if (!mesh.ok()) return mesh.error();
  level_.reset();
  mesh_ = std::move(*mesh);
  set_origin(file.origin_m());
  baked_.materials = file.materials();
  baked_.emitters = file.emitters();
  baked_parts_ = file.movable_parts();
  portals_ = file.portals().portals;
  colours_ = colours_of(baked_.materials, {});
  vertices_ = shade(mesh_, colours_);
  shown_level_.reset();
  ++shape_revision_;
  take_doors();
  return {};
}

Result<void> ViewSession::open_level() {
  request_ = options_.request;
  request_.level_path = options_.path;
  auto level = EditedLevel::open(options_.path, request_.import);
  if (!level.ok()) return level.error();
  level_ = std::move(*level);
  take_shape();
  seen_revision_ = level_->revision();
  saves_output_ = !options_.output.empty();
  return {};
}

// Takes over the surfaces of the level that is edited.
void ViewSession::take_shape() {
  shown_level_ = level_->now().level;
  mesh_ = level_->mesh();
  set_origin(level_->origin_m());
  colours_ = colours_of(level_->now().materials, base_colours(request_.level_path));
  vertices_ = shade(mesh_, colours_);
  ++shape_revision_;
  take_doors();
}

void ViewSession::frame(const WalkKeys& keys, double seconds) {
  camera_.advance(keys, seconds);
  Listener in_world = camera_.listener();
  in_world.position_m += origin_m_;
  sound_->move(in_world);
  follow_edits();
  move_doors(seconds);
  take_events();
  follow_file();
  if (sound_->update() && waits_for_sound_ && plays_last_edit()) {
    waits_for_sound_ = false;
    edit_to_sound_s_ = std::chrono::duration<double>(Clock::now() - edited_).count();
  }
  take_findings();
  sound_->history().update();
  sound_->copy_heard(heard_);
  if (sound_->file() != nullptr && sound_->file()->origin_m() != origin_m_)  // of another bake
    for (HeardSource& source : heard_)
      source.position_m = Vec3f(Vec3(source.position_m) + sound_->file()->origin_m() - origin_m_);
}

Result<void> ViewSession::set_strategy(const StrategyOptions& strategy) {
  if (const auto right = check(strategy); !right.ok()) return right.error();
  strategy_ = strategy;
  AuralizerOptions options = sound_->options();
  options.strategy = make_strategy(strategy);
  options.voices = static_cast<int>(strategy.voices);
  sound_->set_options(options);
  return {};
}

void ViewSession::set_plays_other(bool other) {
  if (other == plays_other_ || !has_other()) return;
  plays_other_ = other;
  if (other)
    sound_->play(options_.compare, "B");
  else if (!own_path_.empty())
    sound_->play(own_path_, "A");
}

void ViewSession::undo() {
  if (level_) level_->undo();
}

void ViewSession::redo() {
  if (level_) level_->redo();
}

Result<void> ViewSession::save() {
  if (!level_) return Error(why_not_editable_);
  if (level_->is_saved()) {
    say("There is nothing to save.");
    return {};
  }
  if (auto saved = level_->save(); !saved.ok()) return saved;
  say("Saved " + level_->sidecar_path());
  const bool is_heard = newest_ && newest_->error.empty() && baked_revision_ == level_->revision();
  if (!emitters().empty()) bake_now(is_heard);
  return {};
}

Result<void> ViewSession::recover() { return level_->recover(); }

// The rest reacts to edits, and brings bakes and files to the window.

namespace {

constexpr auto kPause = std::chrono::milliseconds(120);  // after the last edit of a gesture

}  // namespace

// A bake of the edit before may begin to play after this one.
bool ViewSession::plays_last_edit() const {
  const std::string& path = sound_->file()->path();
  return (first_ && path == first_->path) || (newest_ && path == newest_->path);
}

void ViewSession::bake_now(bool only_last) {
  const bool is_saved = level_->is_saved();
  BakeRequest wanted = request_;
  wanted.import = level_->import_options();
  baked_revision_ = level_->revision();
  baked_request_ =
      bake_->request(wanted, is_saved && saves_output_ ? options_.output : "", only_last);
  if (newest_ && only_last) newest_->is_final = false;
  if (only_last) return;
  newest_.reset();
  first_.reset();
}

void ViewSession::follow_edits() {
  if (!level_) return;
  if (level_->revision() != seen_revision_) {
    seen_revision_ = level_->revision();
    edited_ = Clock::now();
    if (level_->now().level != shown_level_) {
      if (selection_.kind == Selection::Kind::kSurface) select({});
      take_shape();
    } else {
      take_doors();
    }
    check_selection();
    bake_->cancel();  // it reads the file that is written now
    if (auto kept = level_->autosave(); !kept.ok())
      say("Unsaved work cannot be kept safe: " + kept.error().message);
  }
  if (level_->revision() == baked_revision_ || Clock::now() - edited_ < kPause) return;
  if (emitters().empty()) {
    bake_->cancel();
    baked_revision_ = level_->revision();
    say("There is nothing to hear without an emitter.");
    return;
  }
  waits_for_sound_ = true;
  bake_now();
}

void ViewSession::take_events() {
  if (!bake_) return;
  while (auto event = bake_->poll()) {
    if (event->request != baked_request_) continue;
    if (event->error.empty()) {
      own_path_ = event->path;
      if (!plays_other_) sound_->play(own_path_, "A");
      if (event->is_final && event->path == options_.output) say("Wrote " + event->path);
    } else {
      say(event->error);
    }
    newest_ = std::move(event);
    if (!first_) first_ = newest_;
  }
}

// Shows and plays the bake that was opened again when another one has taken its place, as by clamor
// bake --watch, unless edits have led away from it.
void ViewSession::follow_file() {
  constexpr auto kCheck = std::chrono::milliseconds(250);
  const auto now = Clock::now();
  if (!watcher_ || own_path_ != options_.path || now - checked_ < kCheck) return;
  checked_ = now;
  if (watcher_->check() == BakeFileWatcher::Change::kNone) return;
  const auto file = BakeFile::open(options_.path, options_.access);
  if (!file.ok()) return say(file.error().message);
  watcher_->plays(*file);
  if (level_ && !level_->is_saved()) {
    say(options_.path + " was baked again, but is not heard: there are unsaved changes here.");
    return;
  }
  auto taken = take_level_of(*file);
  if (taken.ok()) taken = start_baking();
  if (!taken.ok()) return say(taken.error().message);
  const bool is_gone = selection_.kind == Selection::Kind::kSurface &&
                       selection_.triangle != kNoTriangle &&
                       (selection_.triangle >= mesh_.triangles.size() ||
                        mesh_.materials[selection_.triangle] != selection_.index);
  select(is_gone ? Selection() : selection_);
  check_selection();
  if (!level_ || level_->input_hash() == file->provenance().input_hash)
    say(options_.path + " was baked again.");
  ++followed_;
  if (!plays_other_) sound_->play(own_path_, "A");
}

}  // namespace clamor
