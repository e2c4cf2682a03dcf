#include "tools/view/view_session.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr auto kPause = std::chrono::milliseconds(120);  // after the last edit of a gesture

}  // namespace

Result<std::unique_ptr<ViewSession>> ViewSession::open(ViewOptions options) {
  std::unique_ptr<ViewSession> session(new ViewSession(std::move(options)));
  const ViewOptions& wanted = session->options_;
  session->title_ = std::filesystem::path(wanted.path).filename().string();
  session->strategy_ = wanted.strategy;
  const bool is_bake = std::filesystem::path(wanted.path).extension() == ".clamor";
  if (auto opened = is_bake ? session->open_bake() : session->open_level(); !opened.ok())
    return opened.error();
  PlayerOptions player = wanted.player;
  player.listener = wanted.listener.value_or(in_front_of_first(session->emitters()));
  session->camera_.place(player.listener);
  if (session->is_editable()) {
    session->bake_ = std::make_unique<ProgressiveBake>(wanted.threads);
    if (auto started = session->bake_->start(); !started.ok()) return started.error();
  }
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

Result<void> ViewSession::open_bake() {
  const auto file = BakeFile::open(options_.path, options_.access);
  if (!file.ok()) return file.error();
  own_path_ = options_.path;
  watcher_.emplace(*file);
  if (options_.made_by) {
    request_ = *options_.made_by;
    if (auto level = EditedLevel::open(request_.level_path, request_.import); level.ok()) {
      level_ = std::move(*level);
      mesh_ = level_->mesh();
      vertices_ =
          shade(mesh_, colours_of(level_->now().materials, base_colours(request_.level_path)));
      seen_revision_ = baked_revision_ = level_->revision();
      return {};
    } else {
      why_not_editable_ = level.error().message;
    }
  } else {
    why_not_editable_ =
        "To edit, open the level: " + file->provenance().level + " does not lie beside the bake.";
  }
  auto mesh = file->read_mesh();
  if (!mesh.ok()) return mesh.error();
  mesh_ = std::move(*mesh);
  baked_materials_ = file->materials();
  baked_emitters_ = file->emitters();
  vertices_ = shade(mesh_, colours_of(baked_materials_, {}));
  return {};
}

Result<void> ViewSession::open_level() {
  request_ = options_.request;
  request_.level_path = options_.path;
  auto level = EditedLevel::open(options_.path, request_.import);
  if (!level.ok()) return level.error();
  level_ = std::move(*level);
  mesh_ = level_->mesh();
  vertices_ = shade(mesh_, colours_of(level_->now().materials, base_colours(options_.path)));
  seen_revision_ = level_->revision();
  saves_output_ = !options_.output.empty();
  return {};
}

const std::vector<Material>& ViewSession::materials() const {
  return level_ ? level_->now().materials : baked_materials_;
}
const std::vector<Emitter>& ViewSession::emitters() const {
  return level_ ? level_->now().emitters : baked_emitters_;
}
const std::vector<ListenerSpec>& ViewSession::listeners() const {
  return level_ ? level_->now().listeners : no_listeners_;
}

void ViewSession::frame(const WalkKeys& keys, double seconds) {
  camera_.advance(keys, seconds);
  sound_->move(camera_.listener());
  follow_edits();
  take_news();
  follow_file();
  if (sound_->update() && waits_for_sound_ && !plays_other_) {
    waits_for_sound_ = false;
    edit_to_sound_s_ = std::chrono::duration<double>(Clock::now() - edited_).count();
  }
  sound_->history().update();
  sound_->copy_heard(heard_);
}

void ViewSession::bake_now(bool only_last) {
  const bool is_saved = level_->is_saved();
  BakeRequest wanted = request_;
  wanted.import = level_->import_options();
  baked_revision_ = level_->revision();
  baked_request_ =
      bake_->request(wanted, is_saved && saves_output_ ? options_.output : "", only_last);
  if (newest_ && only_last) newest_->is_final = false;
  if (!only_last) newest_.reset();
}

void ViewSession::follow_edits() {
  if (!level_) return;
  if (level_->revision() != seen_revision_) {
    seen_revision_ = level_->revision();
    edited_ = Clock::now();
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

void ViewSession::take_news() {
  if (!bake_) return;
  while (auto news = bake_->poll()) {
    if (news->request != baked_request_) continue;
    if (news->error.empty()) {
      own_path_ = news->path;
      if (!plays_other_) sound_->play(own_path_, "A");
      if (news->is_final && news->path == options_.output) say("Wrote " + news->path);
    } else {
      say(news->error);
    }
    newest_ = std::move(news);
  }
}

// Plays the bake that was opened again when another one has taken its place, as by clamor bake
// --watch, unless edits have led away from it.
void ViewSession::follow_file() {
  constexpr auto kCheck = std::chrono::milliseconds(250);
  const auto now = Clock::now();
  if (!watcher_ || own_path_ != options_.path || now - checked_ < kCheck) return;
  checked_ = now;
  if (watcher_->check() == BakeFileWatcher::Change::kNone) return;
  say(options_.path + " was baked again.");
  if (!plays_other_) sound_->play(own_path_, "A");
}

void ViewSession::check_selection() {
  const bool is_gone =
      (selection_.kind == Selection::Kind::kEmitter && selection_.index >= emitters().size()) ||
      (selection_.kind == Selection::Kind::kListener && selection_.index >= listeners().size());
  if (is_gone) select({});
}

void ViewSession::select_at(double x, double y, double aspect) {
  const Vec3 from = camera_.listener().position_m, direction = camera_.ray(x, y, aspect);
  const PickedTriangle surface = pick(mesh_, from, direction);
  const double limit_m = surface.triangle == SIZE_MAX ? 1e9 : surface.distance_m;
  std::vector<Vec3> places;
  for (const Emitter& emitter : emitters()) places.push_back(emitter.position_m);
  for (const ListenerSpec& listener : listeners()) places.push_back(listener.at_m);
  const std::size_t place = pick_point(places, from, direction, limit_m);
  if (place < emitters().size())
    select({Selection::Kind::kEmitter, place, 0});
  else if (place != SIZE_MAX)
    select({Selection::Kind::kListener, place - emitters().size(), 0});
  else if (surface.triangle != SIZE_MAX)
    select({Selection::Kind::kSurface, mesh_.materials[surface.triangle],
            static_cast<std::uint32_t>(surface.triangle)});
  else
    select({});
}

void ViewSession::select(const Selection& selection) {
  selection_ = selection;
  surface_.clear();
  outline_.clear();
  if (selection.kind != Selection::Kind::kSurface) return;
  surface_ = surface_of(mesh_, selection.triangle);
  outline_ = outline_of(mesh_, surface_);
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

}  // namespace clamor
