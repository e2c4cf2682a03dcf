// signal_table.h: the signals of a level, each decoded once however many emitters play it.
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
#include "formats/level/signal.h"

namespace clamor {

// Built-in signals make a level audible without sound files: "impulse" is one sample of 1, played
// once; "noise" is a seamless loop of 4 s of pink noise with an RMS of -20 dB full scale.
bool is_built_in_signal(std::string_view word);
std::vector<float> built_in_signal(std::string_view word);

class SignalTable {
 public:
  // The index of the signal with that key, if it has been added.
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
