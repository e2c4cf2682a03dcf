// panels_listen.cpp: the panel that chooses what is heard, and the meters.
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "tools/analysis/spectrogram.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

namespace {

constexpr std::array<const char*, kSoundParts> kPartNames = {"Direct", "Early", "Late"};
constexpr std::array<const char*, kSoundParts> kPartNotes = {
    "the emitters themselves", "at most 80 ms behind", "all that follows"};

// A factor for each: 0 if it is muted, or another one is soloed.
template <std::size_t N, class Factors>
void set_factors(const std::array<bool, N>& muted, const std::array<bool, N>& soloed,
                 Factors& factors) {
  const bool any = std::ranges::any_of(soloed, [](bool is) { return is; });
  for (std::size_t i = 0; i < N; ++i) factors[i] = muted[i] || (any && !soloed[i]) ? 0.0f : 1.0f;
}

ImU32 heat(float share) {
  constexpr std::array<std::array<float, 3>, 5> kStops = {
      {{27, 29, 33}, {52, 60, 92}, {122, 74, 110}, {226, 122, 70}, {255, 226, 150}}};
  const float place = std::clamp(share, 0.0f, 1.0f) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  const float rest = place - static_cast<float>(below);
  const auto mixed = [&](std::size_t c) {
    return static_cast<int>(kStops[below][c] + rest * (kStops[below + 1][c] - kStops[below][c]));
  };
  return IM_COL32(mixed(0), mixed(1), mixed(2), 255);
}

// The shares of a core that the threads of the sound take.
std::string thread_line(const std::vector<ThreadCpuUsage>& threads) {
  double sampler = 0, audio = 0;
  for (const ThreadCpuUsage& thread : threads) {
    if (thread.name == "sampler") sampler += thread.share;
    if (thread.name.starts_with("audio")) audio += thread.share;
  }
  return fmt::format("sampler {:.0f} %, audio {:.0f} %", 100 * sampler, 100 * audio);
}

std::string loudness(double lufs) {
  return std::isfinite(lufs) && lufs > -70 ? fmt::format("{:.1f} LUFS", lufs) : "silent";
}

}  // namespace

void Panels::draw_listen() {
  draw_strategy();
  ImGui::Spacing();
  draw_sound_parts();
  ImGui::Spacing();
  draw_octaves();
  SoloSettings focus = session_.sound().focus();
  if (button("All of the sound", 0, false, !focus.is_neutral())) {
    part_soloed_ = part_muted_ = {};
    soloed_ = muted_ = {};
  }
  set_factors(muted_, soloed_, focus.bands);
  set_factors(part_muted_, part_soloed_, focus.parts);
  if (!(focus == session_.sound().focus())) session_.sound().set_focus(focus);
  ImGui::Spacing();
  draw_source_key();
}

void Panels::draw_strategy() {
  StrategyOptions strategy = session_.strategy();
  caption("Voices (k)");
  if (voices_wanted_ == 0) voices_wanted_ = static_cast<int>(strategy.voices);
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderInt("##voices", &voices_wanted_, 1, 20000, "%d", ImGuiSliderFlags_Logarithmic);
  placed("Voices");
  bool changed = ImGui::IsItemDeactivatedAfterEdit();
  strategy.voices = static_cast<std::size_t>(std::clamp(voices_wanted_, 1, 20000));
  caption("Strategy");
  ImGui::SetNextItemWidth(-1);
  if (placed("Strategy", ImGui::BeginCombo("##strategy", strategy.strategy.c_str()))) {
    for (const StrategyInfo& info : kStrategies)
      if (ImGui::Selectable(info.name, strategy.strategy == info.name)) {
        strategy.strategy = info.name;
        changed = true;
      }
    ImGui::EndCombo();
  }
  if (changed) tell(session_.set_strategy(strategy));
}

void Panels::draw_sound_parts() {
  caption("Parts of the sound: S alone, M muted");
  const float small = 30 * scale_;
  for (std::size_t p = 0; p < kSoundParts; ++p) {
    ImGui::PushID(static_cast<int>(p));
    const std::string part = kPartNames[p];
    part_soloed_[p] ^= placed("Solo " + part, button("S", small, part_soloed_[p]));
    ImGui::SameLine(0, 4 * scale_);
    part_muted_[p] ^= placed("Mute " + part, button("M", small, part_muted_[p]));
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(kPartNames[p]);
    ImGui::SameLine(150 * scale_);
    caption(kPartNotes[p]);
    ImGui::PopID();
  }
}

void Panels::draw_octaves() {
  caption("Octave bands, Hz");
  const float gap = 4 * scale_;
  const float column = (ImGui::GetContentRegionAvail().x - 7 * gap) / 8;
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {2 * scale_, 5 * scale_});
  for (const bool is_solo : {true, false}) {
    auto& row = is_solo ? soloed_ : muted_;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      ImGui::PushID(static_cast<int>(b) + (is_solo ? 100 : 200));
      if (b > 0) ImGui::SameLine(0, gap);
      row[b] ^= placed(fmt::format("{} {}", is_solo ? "Solo" : "Mute", kBandNames[b]),
                       button(is_solo ? kBandNames[b] : "M", column, row[b]));
      ImGui::PopID();
    }
  }
  ImGui::PopStyleVar();
  // Below the octaves, how long each decays.
  const float left = ImGui::GetCursorPosX();
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float t30_s = session_.t30_s()[b];
    const std::string text =
        t30_s > 0 ? fmt::format("{:.{}f}", t30_s, t30_s < 9.995f ? 2 : 1) : "-";
    if (b > 0) ImGui::SameLine();
    ImGui::SetCursorPosX(left + static_cast<float>(b) * (column + gap) +
                         (column - ImGui::CalcTextSize(text.c_str()).x) / 2);
    caption(text);
  }
  wrapped_caption(
      "The upper row plays bands alone, the lower one mutes them; below is T30 of the bake, s.");
}

void Panels::draw_source_key() const {
  ImGui::TextUnformatted("In the level");
  const auto key = [&](ImU32 colour, const char* text) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float size = ImGui::GetFontSize();
    ImGui::GetWindowDrawList()->AddCircleFilled({at.x + size / 2, at.y + size / 2}, size / 3.2f,
                                                colour);
    ImGui::Dummy({size, size});
    ImGui::SameLine();
    caption(text);
  };
  key(IM_COL32(255, 184, 77, 255), "direct sound");
  key(IM_COL32(92, 209, 189, 255), "early reflections");
  key(IM_COL32(158, 178, 235, 255), "late reflections");
  wrapped_caption("Rings are hidden by surfaces; larger is louder.");
}

void Panels::draw_meters(float width, float height) {
  const PlayerStatistics status = session_.sound().statistics();
  const int channels = session_.sound().options().output.channels();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::Dummy({width, height});
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float line = ImGui::GetFontSize();
  const float bar_height =
      std::min(16 * scale_, (height - line - 30 * scale_) / static_cast<float>(channels));
  const float fall = std::pow(10.0f, -ImGui::GetIO().DeltaTime * 20 / 20);  // 20 dB a second
  for (int c = 0; c < channels; ++c) {
    float& peak = peaks_[static_cast<std::size_t>(c)];
    peak = std::max(peak * fall, status.auralizer.peak[static_cast<std::size_t>(c)]);
    const float db = peak > 0 ? 20 * std::log10(peak) : -100;
    const float share = std::clamp((db + 60) / 60, 0.0f, 1.0f);
    const float y = corner.y + static_cast<float>(c) * (bar_height + 4 * scale_);
    draw.AddRectFilled({corner.x, y}, {corner.x + width, y + bar_height}, theme::kField, 3);
    draw.AddRectFilled({corner.x, y}, {corner.x + share * width, y + bar_height},
                       db > -1   ? theme::kBad
                       : db > -6 ? theme::kAccent
                                 : theme::kGood,
                       3);
  }
  const float y = corner.y + static_cast<float>(channels) * (bar_height + 4 * scale_) + 2 * scale_;
  for (const int db : {-60, -40, -20, 0}) {
    const std::string text = std::to_string(db);
    const float size = ImGui::CalcTextSize(text.c_str()).x;
    const float x = corner.x + width * static_cast<float>(db + 60) / 60;
    draw.AddText({std::clamp(x - size / 2, corner.x, corner.x + width - size), y}, theme::kDimText,
                 text.c_str());
  }
  const std::string text =
      session_.sound().is_playing() ? loudness(status.short_term_lufs) : "silent";
  draw.AddText(fonts_.heading, fonts_.heading_px, {corner.x, y + line + 8 * scale_}, theme::kText,
               text.c_str());
  draw.AddText({corner.x, y + line + 34 * scale_}, theme::kDimText, "over the last 3 s");
}

void Panels::draw_figures(const VoiceDisplay& voices) {
  const PlayerStatistics status = session_.sound().statistics();
  const AuralizerStatistics& made = status.auralizer;
  const auto row = [&](const char* name, const std::string& value, bool is_bad = false) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    caption(name);
    ImGui::TableNextColumn();
    if (is_bad) ImGui::PushStyleColor(ImGuiCol_Text, theme::kBad);
    ImGui::TextUnformatted(value.c_str());
    if (is_bad) ImGui::PopStyleColor();
  };
  ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, {6 * scale_, 1.5f * scale_});
  if (ImGui::BeginTable("figures", 2, ImGuiTableFlags_SizingFixedFit, {262 * scale_, 0})) {
    row("Chosen", fmt::format("{} of k {}", voices.chosen(), made.k));
    row("Hidden", fmt::format("{}", voices.hidden()));
    row("Voices", fmt::format("{}", made.voices));
    row("Keyframe", fmt::format("{:.1f} ms of 20", made.sampler_ms), made.sampler_ms > 20);
    // Lateness is red while it is recent.
    const double now_s = ImGui::GetTime();
    if (made.held_blocks > held_blocks_) late_until_s_ = now_s + 5;
    held_blocks_ = made.held_blocks;
    row("Late", fmt::format("{} blocks, {} keyframes", made.held_blocks, made.late_keyframes),
        now_s < late_until_s_);
    if (made.waiting_share > 0.2)
      row("Others", fmt::format("take {:.0f} % of the time", 100 * made.waiting_share));
    if (now_s > threads_due_s_) {
      threads_due_s_ = now_s + 1;
      threads_ = thread_line(session_.sound().thread_shares());
    }
    if (!threads_.empty()) row("Threads", threads_);
    const LiveSound& sound = session_.sound();
    const std::string device =
        !sound.is_playing() ? (sound.is_opening() ? "opening" : "none")
                            : (status.output.has_device ? status.output.device : "no device");
    row("Device", device.size() > 22 ? device.substr(0, 20) + ".." : device);
    if (session_.edit_to_sound_s() > 0)
      row("Edit heard",
          fmt::format(
              "after {:.1f} s{}", session_.edit_to_sound_s(),
              session_.first_bake() && session_.first_bake()->is_reweighed ? ", paths kept" : ""));
    ImGui::EndTable();
  }
  ImGui::PopStyleVar();
}

void Panels::draw_spectrogram(float width, float height) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::Dummy({width, height});
  placed("Spectrogram");
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  draw.AddRectFilled(corner, {corner.x + width, corner.y + height}, theme::kField, 4);
  const auto& columns = session_.sound().history().columns();
  const float labels = 36 * scale_;
  const auto count = static_cast<float>(SoundHistory::kSeconds / SoundHistory::kColumn_s);
  const float step_x = (width - labels) / count, step_y = height / kThirdOctaves;
  float loudest = 1e-9f;
  for (const auto& column : columns)
    for (const float power : column) loudest = std::max(loudest, power);
  float x = corner.x + width - step_x * static_cast<float>(columns.size());
  for (const auto& column : columns) {
    for (std::size_t band = 0; band < column.size(); ++band) {
      const float db = 10 * std::log10(std::max(column[band], 1e-20f) / loudest);
      if (db < -60) continue;
      const float y = corner.y + height - step_y * static_cast<float>(band + 1);
      draw.AddRectFilled({x, y}, {x + step_x + 0.5f, y + step_y + 0.5f}, heat(1 + db / 60));
    }
    x += step_x;
  }
  for (const auto& [band, name] : {std::pair{6, "125"}, {15, "1k"}, {24, "8k"}}) {
    const float y = corner.y + height - step_y * (static_cast<float>(band) + 0.5f);
    draw.AddText({corner.x + 4 * scale_, y - ImGui::GetFontSize() / 2}, theme::kDimText, name);
  }
}

}  // namespace clamor
