// deposit.h: the record that a photon leaves where a surface reflects or transmits it.
//
// A deposit becomes a secondary source (formats/bake_file/source.h) when it is kept. Their powers
// have different units: a deposit's power assumes that its photon alone carries the emitter's
// power, a source's power is the share of that photon.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/portal.h"

namespace clamor {

// The journal stores deposits as they are (trace_journal.cpp), so the layout must not change.
struct Deposit {
  Vec3f position_m{};
  Vec3f normal{};  // unit; out of the surface, towards the side that the power leaves on
  Vec3f mirror{};  // unit; mirror direction of the arriving sound, or its direction if transmitted
  float delay_s = 0;  // since the emission
  Bands power{};      // of the emitter's whole power, after absorption
  float random = 1;   // uniform in (0, 1]; decides thinning and rounding, but is not the source's u
  std::uint16_t material = 0;
  std::uint16_t photon = 0;  // index within its run
  std::uint32_t emitter = 0;
  PortalSet portals{};  // that the path has passed
};
static_assert(sizeof(Deposit) == 92);

// The secondary source of a deposit, of which its emitter traced 1 / `photon_share` photons. u is
// the deposit's random number until quantize_sources() draws the final u and polarity.
inline Source secondary_source(const Deposit& deposit, double photon_share) {
  Source source;
  source.position_m = deposit.position_m;
  source.normal = deposit.normal;
  source.mirror = deposit.mirror;
  source.delay_s = deposit.delay_s;
  for (std::size_t b = 0; b < kBandCount; ++b)
    source.power[b] = static_cast<float>(deposit.power[b] * photon_share);
  source.u = deposit.random;
  source.emitter = deposit.emitter;
  source.material = deposit.material;
  return source;
}

}  // namespace clamor
