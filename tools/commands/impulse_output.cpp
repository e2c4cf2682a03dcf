#include "tools/commands/impulse_output.h"

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <system_error>

#include <fmt/format.h>

#include "common/sample_rate.h"
#include "common/utf8_path.h"
#include "formats/audio/wav_writer.h"
#include "formats/files/output_target.h"
#include "formats/level/level_origin.h"
#include "tools/analysis/json_values.h"

namespace clamor {

namespace {

void print_table(const char* title, const RoomParameters& parameters, std::ostream& out) {
  out << fmt::format("{:<10}", title);
  for (const double hz : kBandCentres_hz) out << fmt::format("{:>9} Hz", hz);
  out << '\n';
  for (const ParameterKind& kind : kParameterKinds) {
    out << fmt::format("  {:<8}", fmt::format("{} {}", kind.name, kind.unit));
    for (const auto& value : parameters.*kind.value)
      out << (value ? fmt::format("{:>12.{}f}", *value, kind.digits) : fmt::format("{:>12}", "-"));
    out << '\n';
  }
}

// Writes a channel for each place.
Result<void> write_wav(const std::string& path, std::span<const MeasuredPlace> all) {
  Result<WavWriter> wav =
      WavWriter::create(path, static_cast<int>(all.size()), kSampleRate_hz, SampleFormat::kFloat32);
  if (!wav) return wav.error();
  std::size_t frames = 0;
  for (const MeasuredPlace& one : all) frames = std::max(frames, one.waveform.size());
  std::vector<float> samples(frames * all.size(), 0);
  for (std::size_t c = 0; c < all.size(); ++c)
    for (std::size_t i = 0; i < all[c].waveform.size(); ++i)
      samples[i * all.size() + c] = all[c].waveform[i];
  if (auto written = wav->write(samples); !written) return written;
  return wav->finish();
}

OrderedJson figures_of(const MeasuredPlace& measured) {
  OrderedJson json = {{"energy", measured.of_energy},
                      {"waveform", measured.of_waveform},
                      {"warnings", OrderedJson::array()}};
  if (measured.warning) json["warnings"].push_back(*measured.warning);
  return json;
}

std::string impulse_json(std::span<const MeasuredPlace> all) {
  OrderedJson json;
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  if (all.size() == 1) {
    json.update(figures_of(all.front()));
  } else {
    for (const MeasuredPlace& measured : all) {
      OrderedJson one = {{"name", measured.place.name},
                         {"listener_m", as_json(measured.place.at_m)}};
      one.update(figures_of(measured));
      json["places"].push_back(std::move(one));
    }
  }
  return json_text(json);
}

}  // namespace

void print_measured(std::span<const MeasuredPlace> all, bool as_json, std::ostream& out) {
  if (as_json) {
    out << impulse_json(all) << '\n';
    return;
  }
  for (const MeasuredPlace& measured : all) {
    if (all.size() > 1)
      out << fmt::format("place {} at {}\n", measured.place.name,
                         place_in_words(measured.place.at_m));
    print_table("energy", measured.of_energy, out);
    print_table("waveform", measured.of_waveform, out);
  }
}

Result<ImpulseOutput> ImpulseOutput::choose(const std::string& path, std::size_t places) {
  ImpulseOutput output;
  output.path_ = path;
  std::error_code ignored;
  output.is_folder_ = !path.empty() && (path.ends_with('/') ||
                                        std::filesystem::is_directory(path_of(path), ignored));
  while (output.is_folder_ && output.path_.size() > 1 && output.path_.ends_with('/'))
    output.path_.pop_back();
  if (path.empty() || output.is_folder_) return output;
  if (const auto right = check_sound_file(path, static_cast<int>(std::min(places, kMaxChannels)));
      !right.ok())
    return Error(right.error().message + " A folder, as in responses/, has a file for each place");
  if (const auto samples = sample_format("float", path); !samples.ok()) return samples.error();
  if (places > kMaxChannels)
    return Error(
        fmt::format("{}: a file takes {} places at most, not {}; name a folder, as in "
                    "responses/, for a file for each place",
                    path, kMaxChannels, places));
  return output;
}

Result<void> ImpulseOutput::check(std::span<const NamedPlace> places,
                                  const std::vector<std::string>& inputs) const {
  if (path_.empty()) return {};
  InputFiles read;
  for (const std::string& input : inputs) read.add(input);
  if (is_folder_) {
    std::error_code failed;
    std::filesystem::create_directories(path_of(path_), failed);
    if (failed) return Error(path_ + ": the folder cannot be made: " + failed.message());
    for (const NamedPlace& place : places)
      if (const auto target = OutputTarget::find(file_of(place), read); !target.ok())
        return target.error();
    return {};
  }
  const auto target = OutputTarget::find(path_, read);
  if (!target.ok()) return target.error();
  if (target->is_stdout())
    return Error(path_ + ": the room parameters are printed there; name a file for the waveform");
  return {};
}

Result<void> ImpulseOutput::take(MeasuredPlace& measured) const {
  if (path_.empty()) measured.waveform = {};
  if (!is_folder_) return {};
  if (const auto written = write_wav(file_of(measured.place), {&measured, 1}); !written.ok())
    return written;
  measured.waveform = {};
  return {};
}

Result<void> ImpulseOutput::finish(std::span<const MeasuredPlace> all) const {
  return path_.empty() || is_folder_ ? Result<void>() : write_wav(path_, all);
}

}  // namespace clamor
