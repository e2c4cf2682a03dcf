// modal_room.h: the exact sound field of a box with locally reacting walls, for tests.
//
// Its walls have a real specific admittance, the same everywhere, so that the waves along the three
// axes separate. Modes along x and y are summed; along z, the field between two walls is known in
// closed form, so that the sum converges exponentially with the difference in height of source and
// listener (P. Morse, K. Ingard. Theoretical Acoustics. McGraw-Hill 1968, ch. 9). It shares no code
// with Clamor.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "common/vec.h"

namespace clamor::testing {

using Complex = std::complex<double>;

struct ModalRoom {
  Vec3 size_m{};
  double admittance = 0;  // the air's impedance over the wall's
  double speed_mps = 0;

  // Share of the power that the walls absorb of diffuse sound (E. T. Paris. On the coefficient of
  // sound-absorption measured by the reverberation method. Phil. Mag. 5, 1928).
  double absorption() const {
    const double y = admittance;
    return 8 * y * (1 + y / (1 + y) - 2 * y * std::log(1 + 1 / y));
  }
};

// The first waves along an axis that fulfil the condition of the walls at both ends: cosines and
// sines about the middle, with complex wave numbers.
class AxisWaves {
 public:
  AxisWaves(double length_m, std::size_t count) : length_m_(length_m), numbers_(count) {
    for (std::size_t n = 0; n < count; ++n)
      numbers_[n] = static_cast<double>(n) * std::numbers::pi / length_m;
  }

  // Moves the wave numbers q to another product of the admittance with the wave number in air, by
  // Newton's method; products must grow in small steps from 0. Waves are even or odd:
  //
  //   q sin(q L / 2) = y cos(q L / 2),     q cos(q L / 2) = -y sin(q L / 2),     y = i k
  //   admittance.
  void follow(double k_times_admittance) {
    const Complex y(0, k_times_admittance);
    if (numbers_[0] == Complex()) numbers_[0] = std::sqrt(2.0 * y / length_m_);
    for (std::size_t n = 0; n < numbers_.size(); ++n)
      for (int step = 0; step < 4; ++step) {
        Complex& q = numbers_[n];
        const Complex s = std::sin(q * length_m_ / 2.0), c = std::cos(q * length_m_ / 2.0);
        const Complex value = n % 2 == 0 ? q * s - y * c : q * c + y * s;
        const Complex slope = n % 2 == 0 ? s + (q * c + y * s) * length_m_ / 2.0
                                         : c + (y * c - q * s) * length_m_ / 2.0;
        q -= value / slope;
      }
  }

  std::size_t size() const { return numbers_.size(); }
  Complex number(std::size_t n) const { return numbers_[n]; }

  // Product of wave n at two places, over the integral of its square.
  Complex product(std::size_t n, double a_m, double b_m) const {
    const Complex q = numbers_[n], part = std::sin(q * length_m_) / (2.0 * q);
    const auto turn = [&](double at_m) { return q * (at_m - length_m_ / 2); };
    return n % 2 == 0 ? std::cos(turn(a_m)) * std::cos(turn(b_m)) / (length_m_ / 2 + part)
                      : std::sin(turn(a_m)) * std::sin(turn(b_m)) / (length_m_ / 2 - part);
  }

 private:
  double length_m_;
  std::vector<Complex> numbers_;
};

// Frequencies step_hz, 2 step_hz, ... up to highest_hz, which need not be heard below lowest_hz.
struct FrequencyGrid {
  double step_hz = 0.4, lowest_hz = 16, highest_hz = 1800;
};

// Pressure, by frequency and place, of a source whose pressure in a free field is exp(-ikr) / r.
// All places are at one height, which is not the source's. Costs 2 s for a room of 60 m3 and 24
// places up to 1800 Hz.
inline std::vector<std::vector<Complex>> modal_pressure(const ModalRoom& room,
                                                        const FrequencyGrid& grid,
                                                        const Vec3& source_m,
                                                        const std::vector<Vec3>& places_m) {
  const double low_m = std::min(source_m.z, places_m[0].z),
               high_m = std::max(source_m.z, places_m[0].z), height_m = room.size_m.z;
  const double turns_per_m = 2 * std::numbers::pi / room.speed_mps;
  // Waves with greater numbers lose more than 80 dB over the difference in height.
  const double greatest =
      std::hypot(turns_per_m * grid.highest_hz, std::log(1e4) / (high_m - low_m));
  const auto count = [&](double length_m) {
    return static_cast<std::size_t>(greatest * length_m / std::numbers::pi) + 2;
  };
  AxisWaves along_x(room.size_m.x, count(room.size_m.x)),
      along_y(room.size_m.y, count(room.size_m.y));
  const std::size_t nx = along_x.size(), ny = along_y.size();
  std::vector<Complex> across_x(nx * places_m.size()), across_y(ny * places_m.size()), column(ny);
  std::vector<std::vector<Complex>> pressure;
  for (double hz = grid.step_hz; hz < grid.highest_hz; hz += grid.step_hz) {
    const double k = turns_per_m * hz;
    const Complex y(0, k * room.admittance);
    along_x.follow(k * room.admittance);
    along_y.follow(k * room.admittance);
    auto& heard = pressure.emplace_back(places_m.size());
    if (hz < grid.lowest_hz) continue;
    for (std::size_t p = 0; p < places_m.size(); ++p) {
      for (std::size_t n = 0; n < nx; ++n)
        across_x[p * nx + n] = along_x.product(n, places_m[p].x, source_m.x);
      for (std::size_t n = 0; n < ny; ++n)
        across_y[p * ny + n] = along_y.product(n, places_m[p].y, source_m.y);
    }
    for (std::size_t i = 0; i < nx; ++i) {
      std::size_t used = 0;
      for (; used < ny; ++used) {
        const Complex a = along_x.number(i), b = along_y.number(used), across = a * a + b * b;
        if (across.real() > greatest * greatest) break;
        // From the floor up and from the ceiling down, over the Wronskian of the two.
        const Complex q = std::sqrt(k * k - across);
        const auto wave = [&](double z) { return std::cos(q * z) + y / q * std::sin(q * z); };
        column[used] =
            4 * std::numbers::pi * wave(low_m) * wave(height_m - high_m) /
            ((q - y * y / q) * std::sin(q * height_m) - 2.0 * y * std::cos(q * height_m));
      }
      for (std::size_t p = 0; p < places_m.size(); ++p) {
        Complex sum = 0;
        for (std::size_t j = 0; j < used; ++j) sum += column[j] * across_y[p * ny + j];
        heard[p] += sum * across_x[p * nx + i];
      }
    }
  }
  return pressure;
}

}  // namespace clamor::testing
