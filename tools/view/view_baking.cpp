// view_baking.cpp: what follows an edit in the window, and what bakes and files bring to it.
#include <utility>

#include "tools/view/view_session.h"

namespace clamor {

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
