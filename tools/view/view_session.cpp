#include "tools/view/view_session.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "common/bounds.h"
#include "tools/report/level_findings.h"
#include "tools/report/room_summary.h"
#include "tools/view/viewpoint.h"

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
      mesh_ = level_->mesh();
      set_origin(level_->origin_m());
      vertices_ =
          shade(mesh_, colours_of(level_->now().materials, base_colours(request_.level_path)));
      seen_revision_ = baked_revision_ = level_->revision();
      ++shape_revision_;
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
  baked_materials_ = file.materials();
  baked_emitters_ = file.emitters();
  vertices_ = shade(mesh_, colours_of(baked_materials_, {}));
  ++shape_revision_;
  return {};
}

Result<void> ViewSession::open_level() {
  request_ = options_.request;
  request_.level_path = options_.path;
  auto level = EditedLevel::open(options_.path, request_.import);
  if (!level.ok()) return level.error();
  level_ = std::move(*level);
  mesh_ = level_->mesh();
  set_origin(level_->origin_m());
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
  Listener in_world = camera_.listener();
  in_world.position_m += origin_m_;
  sound_->move(in_world);
  follow_edits();
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
                       (selection_.triangle >= mesh_.triangles.size() ||
                        mesh_.materials[selection_.triangle] != selection_.index);
  select(is_gone ? Selection() : selection_);
  check_selection();
  if (!level_ || level_->input_hash() == file->provenance().input_hash)
    say(options_.path + " was baked again.");
  ++followed_;
  if (!plays_other_) sound_->play(own_path_, "A");
}

Listener ViewSession::viewpoint(const Vec3& place_m, double size_m) const {
  std::vector<Vec3> inside_m;
  for (const Emitter& emitter : emitters()) {
    inside_m.push_back(emitter.position_m);
    if (inside_m.size() == 2) break;
  }
  if (inside_m.empty() && !mesh_.vertices_m.empty()) {
    const auto [low_m, high_m] = bounds_of(mesh_.vertices_m);
    inside_m.push_back(Vec3(0.5f * (low_m + high_m)));
  }
  if (sound_ != nullptr) inside_m.push_back(camera_.listener().position_m);
  return viewpoint_of(mesh_, place_m, size_m, inside_m);
}

void ViewSession::take_findings() {
  const auto file = sound_->file();
  if (file == findings_of_) return;
  findings_of_ = file;
  findings_ = findings_of(file->statistics());
  for (LevelFinding& finding : findings_)
    if (finding.place_m) *finding.place_m -= origin_m_;
  t30_s_ = file->statistics().decay.t30_s;
  cause_of_decay_.clear();
  if (file->materials().size() >= materials().size())  // it is of this level
    cause_of_decay_ =
        clamor::cause_of_decay(file->statistics().decay, absorbing_areas(mesh_, file->materials()));
  // Printed places are rounded to decimetres.
  constexpr double kNear_m = 0.1;
  if (!mark_ || mark_->kind != LevelFinding::Kind::kFact) return;
  for (const LevelFinding& finding : findings_)
    if (finding.place_m && length(*finding.place_m - mark_->place_m) < kNear_m) {
      mark_ = PlaceMark{*finding.place_m, title_of(finding.kind), finding.kind};
      return say(finding.text);
    }
}

void ViewSession::show(const LevelFinding& finding) {
  if (!finding.place_m) return;
  camera_.place(viewpoint(*finding.place_m, finding.size_m));
  mark_ = PlaceMark{*finding.place_m, title_of(finding.kind), finding.kind};
  say(finding.text);
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

Result<void> ViewSession::add_emitter(const std::string& signal) {
  if (!level_) return Error(why_not_editable_);
  constexpr double kAhead_m = 1.5;
  const Listener at = camera_.listener();
  const PickedTriangle wall = pick(mesh_, at.position_m, at.forward());
  const double ahead_m =
      wall.triangle == SIZE_MAX ? kAhead_m : std::min(kAhead_m, 0.6 * wall.distance_m);
  const auto added =
      level_->add_emitter(signal, at.position_m + ahead_m * at.forward(), -1.0 * at.forward());
  if (!added.ok()) return added.error();
  select({Selection::Kind::kEmitter, *added, 0});
  return {};
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
