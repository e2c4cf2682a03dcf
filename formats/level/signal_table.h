// signal_table.h: the sounds of a level, each decoded and kept once however many emitters play it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/result.h"
#include "formats/level/level.h"

namespace clamor {

// Built in, so that a level can be heard without any sound file: "impulse" is one sample of 1,
// played once; "noise" is 4 s of pink noise, RMS -20 dB re full scale, that loops without a seam.
bool is_built_in_signal(std::string_view word);
std::vector<float> built_in_signal(std::string_view word);

class SignalTable {
 public:
  // The index of the signal of that key, if it is there already.
  std::optional<std::uint32_t> find(const std::string& key, bool loop) const;
  std::uint32_t add(const std::string& key, std::string name, std::vector<float> samples,
                    bool loop);

  std::uint32_t built_in(const std::string& word, bool loop);

  const std::vector<Signal>& signals() const { return signals_; }
  std::vector<Signal> take() { return std::move(signals_); }

 private:
  std::map<std::pair<std::string, bool>, std::uint32_t> known_;
  std::vector<Signal> signals_;
};

}  // namespace clamor
