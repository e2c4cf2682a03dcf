// impulse_output.h: what clamor impulse measured, as tables, JSON (tools/README.md documents its
// keys) and sound files.
#pragma once

#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/analysis/room_parameters.h"
#include "tools/commands/places_file.h"

namespace clamor {

struct MeasuredPlace {
  NamedPlace place;
  std::vector<float> waveform;  // empty once it is written
  RoomParameters of_energy, of_waveform;
  std::optional<std::string> warning;  // why little or nothing is heard
};

// Prints one place alone, or a list with names.
void print_measured(std::span<const MeasuredPlace> all, bool as_json, std::ostream& out);

// Where waveforms go: nowhere, to a file with a channel for each place, or to a folder with a file
// NAME.wav for each, which is written as soon as the place is measured.
class ImpulseOutput {
 public:
  // A file takes at most this many places: more channels than readers take.
  static constexpr std::size_t kMaxChannels = 1024;

  // The Error is bad usage. An existing folder, and a path that ends in "/", is a folder.
  static Result<ImpulseOutput> choose(const std::string& path, std::size_t places);

  // Before anything is measured: makes the folder, and checks that everything can be written, not
  // to where the results are printed, and over no file that the command reads.
  Result<void> check(std::span<const NamedPlace> places,
                     const std::vector<std::string>& inputs) const;

  bool is_folder() const { return is_folder_; }
  // Writes a place to its file in a folder, and forgets its waveform; otherwise leaves it.
  Result<void> take(MeasuredPlace& measured) const;
  // Writes the file; shorter responses end in silence.
  Result<void> finish(std::span<const MeasuredPlace> all) const;

 private:
  std::string file_of(const NamedPlace& place) const { return path_ + "/" + place.name + ".wav"; }

  std::string path_;  // empty: nothing is written
  bool is_folder_ = false;
};

}  // namespace clamor
