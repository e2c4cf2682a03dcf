// violin.h: a violin phrase: a bowed string by physical model, heard through a wooden body.
//
// The string is STK's Bowed (two delay lines and a friction table, after J. O. Smith and M. E.
// McIntyre), taken at the bridge before STK's own body filter, with pitch and bow under our control
// at every frame. The body is modes at a real violin's frequencies and the bridge hill.
#pragma once

#include <cstdint>
#include <vector>

namespace clamor::assets {

// Eleven seconds and a half, the last one a breath, to be looped. A slow melody of our own, in D.
std::vector<std::int16_t> make_violin_phrase();

}  // namespace clamor::assets
