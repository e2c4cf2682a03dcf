// default_hrtf.h: the HRTF that travels inside the program: KEMAR's, fitted.
// assets/generate/make_head makes it.
#pragma once

#include <memory>

namespace clamor {

class Hrtf;

// Any thread; takes milliseconds.
std::shared_ptr<const Hrtf> default_hrtf();

}  // namespace clamor
