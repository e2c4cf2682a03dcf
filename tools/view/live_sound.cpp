#include "tools/view/live_sound.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/platform/thread.h"
#include "common/sample_rate.h"
#include "formats/bake_file/baked_portals.h"
#include "runtime/engine/auralizer.h"
#include "runtime/occlusion/moving_parts.h"

namespace clamor {

namespace {

// Opens and closes the portals and parts of a bake. No part moves where nothing occludes.
void open_doors(const LevelDoors& doors, const BakeFile& file, Auralizer& auralizer) {
  auralizer.set_portals(doors.openness_of(file.portals().portals, file.origin_m()));
  MovingParts* const parts = auralizer.parts();
  if (parts == nullptr) return;
  const std::span<const PartHandle> handles = auralizer.level_parts();
  for (std::size_t p = 0; p < handles.size(); ++p) {
    const PartPose pose = doors.pose_of(file.movable_parts()[p], file.origin_m());
    // The pose is in range, and the handle is the level's own.
    (void)parts->move(handles[p], in_world(pose, file.origin_m()));
  }
}

}  // namespace

LiveSound::LiveSound(PlayerOptions options, FileAccess access)
    : options_(std::move(options)),
      access_(access),
      history_(std::make_shared<SoundHistory>(options_.auralizer.output.channels())),
      listener_(options_.listener) {
  options_.auralizer.keeps_sample = true;
  options_.listen = [history = history_](std::span<const float> played) { history->add(played); };
  thread_ = std::jthread([this](const std::stop_token& ended) { run(ended); });
}

LiveSound::~LiveSound() {
  thread_ = {};  // it may use the player
}

void LiveSound::submit(Request next) {
  const std::lock_guard lock(mutex_);
  next_ = std::move(next);
  is_opening_ = true;
  asked_.notify_all();
}

void LiveSound::play(const std::string& path, const std::string& name) {
  path_ = path;
  submit({path, name, options_.auralizer, listener_});
}

void LiveSound::set_options(const AuralizerOptions& options) {
  options_.auralizer = options;
  options_.auralizer.keeps_sample = true;
  if (!path_.empty()) submit({path_, name_, options_.auralizer, listener_});
}

void LiveSound::move(const Listener& listener) {
  listener_ = listener;
  if (player_ != nullptr) player_->move(listener);
}

void LiveSound::set_focus(const SoloSettings& focus) {
  focus_ = focus;
  if (player_ != nullptr) player_->set_focus(focus);
}

void LiveSound::set_doors(const LevelDoors& doors) {
  doors_ = doors;
  if (player_ == nullptr || file_ == nullptr) return;
  player_->change([this](Auralizer& playing) { open_doors(doors_, *file_, playing); });
}

void LiveSound::run(const std::stop_token& ended) {
  name_thread("opening");
  while (!ended.stop_requested()) {
    std::optional<Request> next;
    const Player* playing = nullptr;
    {
      std::unique_lock lock(mutex_);
      // The last one opened must have been taken over, because the player is made only once.
      asked_.wait(lock, ended, [this] {
        return next_.has_value() && !opened_.has_value() && !is_handing_over_;
      });
      if (ended.stop_requested()) return;
      next = std::exchange(next_, std::nullopt);
      playing = playing_;
    }
    Opened opened = open(std::move(*next), playing);
    const std::lock_guard lock(mutex_);
    opened_ = std::move(opened);
  }
}

LiveSound::Opened LiveSound::open(Request request, const Player* playing) const {
  Opened opened;
  opened.request = std::move(request);
  auto file = BakeFile::open(opened.request.path, access_);
  if (!file.ok()) {
    opened.error = file.error().message;
    return opened;
  }
  opened.file = std::make_shared<const BakeFile>(std::move(*file));
  if (playing != nullptr) {
    auto prepared = playing->prepare(opened.file, opened.request.options, opened.request.listener);
    if (prepared.ok())
      opened.prepared = std::move(*prepared);
    else
      opened.error = prepared.error().message;
    return opened;
  }
  PlayerOptions options = options_;
  options.auralizer = opened.request.options;
  auto player = Player::create(opened.file, options);
  if (player.ok())
    opened.player = std::move(*player);
  else
    opened.error = player.error().message;
  return opened;
}

bool LiveSound::update() {
  std::optional<Opened> opened;
  {
    const std::lock_guard lock(mutex_);
    opened = std::exchange(opened_, std::nullopt);
    if (opened && !next_) is_opening_ = false;
    is_handing_over_ = opened.has_value();
  }
  if (!opened) return false;
  error_ = opened->error;
  if (error_.empty() && opened->player != nullptr) {
    opened->player->move(listener_);
    opened->player->set_focus(focus_);
    opened->player->change([&](Auralizer& next) { open_doors(doors_, *opened->file, next); });
    if (const auto started = opened->player->start(); !started.ok())
      error_ = started.error().message;
    else
      player_ = std::move(opened->player);
  } else if (error_.empty()) {
    open_doors(doors_, *opened->file, *opened->prepared->auralizer);
    if (const auto replaced = player_->replace(std::move(opened->prepared)); !replaced.ok())
      error_ = replaced.error().message;
  }
  {
    const std::lock_guard lock(mutex_);
    playing_ = player_.get();
    is_handing_over_ = false;
    asked_.notify_all();
  }
  if (!error_.empty()) return false;
  file_ = std::move(opened->file);
  name_ = opened->request.name;
  return true;
}

PlayerStatistics LiveSound::statistics() const {
  return player_ != nullptr ? player_->statistics() : PlayerStatistics{};
}

std::vector<ThreadCpuUsage> LiveSound::thread_shares() const {
  return player_ != nullptr ? player_->thread_shares() : std::vector<ThreadCpuUsage>();
}

void LiveSound::copy_heard(std::vector<HeardSource>& heard) const {
  heard.clear();
  if (player_ != nullptr) player_->copy_heard(heard);
}

Result<void> LiveSound::stop() {
  thread_ = {};
  return player_ != nullptr ? player_->stop() : Result<void>();
}

void SoundHistory::add(std::span<const float> interleaved) {
  const std::lock_guard lock(mutex_);
  for (const float sample : interleaved) {
    sum_ += sample;
    if (++part_ < channels_) continue;
    // Channels are about as loud as each other and mostly not alike, so that powers add.
    waiting_.push_back(sum_ / std::sqrt(static_cast<float>(channels_)));
    part_ = 0;
    sum_ = 0;
  }
  // Nobody looks: only the newest columns matter.
  constexpr auto kMost = static_cast<std::size_t>(kSampleRate_hz);
  if (waiting_.size() > kMost)
    waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(kMost));
}

void SoundHistory::update() {
  constexpr auto kColumn_frames = static_cast<std::size_t>(kColumn_s * kSampleRate_hz);
  std::vector<float> fresh;
  {
    const std::lock_guard lock(mutex_);
    fresh.swap(waiting_);
  }
  for (std::size_t at = 0; at < fresh.size();) {
    const std::size_t count = std::min(fresh.size() - at, kColumn_frames - since_column_);
    const auto first = fresh.begin() + static_cast<std::ptrdiff_t>(at);
    window_.insert(window_.end(), first, first + static_cast<std::ptrdiff_t>(count));
    at += count;
    since_column_ += count;
    if (since_column_ < kColumn_frames) break;
    since_column_ = 0;
    if (window_.size() < kWindow_frames) continue;
    window_.erase(window_.begin(), window_.end() - static_cast<std::ptrdiff_t>(kWindow_frames));
    const Spectrogram heard = spectrogram_of({{window_}}, 1);
    Column column{};
    for (std::size_t band = 0; band < column.size(); ++band)
      column[band] = static_cast<float>(heard.power.front()[band]);
    columns_.push_back(column);
    while (static_cast<double>(columns_.size()) * kColumn_s > kSeconds) columns_.pop_front();
  }
}

}  // namespace clamor
