// bus_error_guard.cpp: no guard, so that files are read rather than mapped.
//
// Windows reports pages of a file that cannot be read by an exception that MinGW's compiler cannot
// handle, and lets nobody replace a file that is mapped. WebAssembly copies what it maps.
#include "common/platform/bus_error_guard.h"

namespace clamor {

std::span<std::byte> whole_pages(std::span<std::byte> bytes) { return bytes; }

bool BusErrorGuard::install() { return false; }

bool BusErrorGuard::replace_for_thread(void*) { return false; }

BusErrorGuard::BusErrorGuard(std::span<std::byte> bytes)
    : pages_(bytes), zeros_begin_(bytes.data() + bytes.size()), outer_(nullptr) {}

BusErrorGuard::~BusErrorGuard() = default;

std::span<std::byte> BusErrorGuard::zeros() const { return {}; }

}  // namespace clamor
