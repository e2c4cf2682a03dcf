// sparse_response.h: the response of many taps, made in the time domain and transformed.
//
// A tap is a spline at its delay with a lane for each octave, so it costs a few additions of
// vectors. How the octaves' filters overlap, and what the spline takes from high frequencies, is
// applied once for all taps to the spectra, where the lanes are then added up: the filters are real
// because the filter banks have zero phase. Voices read their signals by the same octaves
// (mix_kernel.h), so a source sounds alike as voice and as tap.
//
// Threads: the sampler's. Memory: 70 kB per partition.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/field/field_kernel.h"
#include "runtime/field/field_response.h"
#include "runtime/voices/lane_fourier.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

class SparseResponse {
 public:
  explicit SparseResponse(const MixMode& mode);

  // For delays below so many partitions.
  void reserve(std::size_t partitions);
  // Taps at an ear. Delays must be in range.
  void add(std::size_t ear, std::span<const Tap> taps);

  // Spectra of all partitions that have taps, after which the response is empty. Calls
  // spectrum_of(partition) for each, ascending.
  template <class SpectrumOf>
  void transform(const SpectrumOf& spectrum_of) {
    std::array<std::size_t, 2> partitions;
    std::array<FieldSpectrum*, 2> spectra{};
    std::size_t count = 0;
    for (std::size_t p = 0; p < touched_.size(); ++p) {
      if (touched_[p] == 0) continue;
      partitions[count] = p;
      spectra[count++] = &spectrum_of(p);
      if (count == 2) transform(partitions, spectra, std::exchange(count, 0));
    }
    transform(partitions, spectra, count);
  }

 private:
  static constexpr std::size_t kPad = 2;  // rows beyond both ends that splines reach

  // Transforms have eight lanes, which one partition fills or two.
  static constexpr std::size_t kLanes = 8;
  template <std::size_t kBands>
  struct Layer {
    static constexpr std::size_t kPartitions = kLanes / kBands;
    Layer(const FieldLayer& layer_size, const std::vector<float>& lane_filters);

    // Moves partitions of rows to spectra.
    void transform(std::span<const std::size_t> partitions,
                   const std::array<float*, kPartitions>& spectra);

    const FieldLayer size;
    const LaneFourier fourier;
    const std::vector<float>& filters;           // [index][lane], over the size of the transform
    std::array<std::vector<float>, kEars> rows;  // [pad, then frame][band]
    struct alignas(64) Vector {
      std::array<float, 16> floats;
    };
    std::array<std::vector<Vector>, kEars> work;  // [point][lane]
  };
  void transform(const std::array<std::size_t, 2>& partitions,
                 const std::array<FieldSpectrum*, 2>& spectra, std::size_t count);

  Layer<kHighFieldLanes> high_;
  Layer<kLowFieldLanes> low_;
  std::array<FieldSums, 2> sums_{};  // scratch memory
  std::vector<char> touched_;        // by partition
};

}  // namespace clamor
