// thread.cpp: the only thread of a module without shared memory.
#include "common/platform/thread.h"

namespace clamor {

void name_thread(const char*) {}

int usable_cores() { return 1; }

void prioritise_audio_thread() {}

std::optional<clockid_t> clock_of_this_thread() noexcept { return std::nullopt; }

CancellationDelay::CancellationDelay() noexcept = default;
CancellationDelay::~CancellationDelay() = default;

}  // namespace clamor
