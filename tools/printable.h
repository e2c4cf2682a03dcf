// printable.h: names and numbers as a terminal shows them.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

namespace clamor {

// A name that may come from anywhere, without what would steer the terminal.
inline std::string printable(std::string name) {
  for (char& c : name)
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  return name;
}

// "violin", or of a long name its beginning and "...".
inline std::string shortened(const std::string& name, std::size_t width) {
  const std::string whole = printable(name);
  return whole.size() <= width ? whole : whole.substr(0, width - 3) + "...";
}

// "16 416".
inline std::string grouped(std::uint64_t number) {
  std::string digits = std::to_string(number);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, " ");
  return digits;
}

// "1 photon", "16 416 photons".
inline std::string counted(std::uint64_t number, const std::string& thing) {
  return grouped(number) + " " + thing + (number == 1 ? "" : "s");
}

inline double decibels_of(double power) { return power > 0 ? 10 * std::log10(power) : -INFINITY; }

}  // namespace clamor
