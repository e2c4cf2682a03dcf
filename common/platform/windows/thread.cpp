// thread.cpp: threads by Windows.
#include "common/platform/thread.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <thread>

#include "common/platform/windows/win32.h"

namespace clamor {

void name_thread(const char* name) {
  using SetDescription = HRESULT(WINAPI*)(HANDLE, PCWSTR);  // since Windows 10
  static const auto set = reinterpret_cast<SetDescription>(reinterpret_cast<void*>(
      ::GetProcAddress(::GetModuleHandleW(L"kernel32.dll"), "SetThreadDescription")));
  if (set != nullptr) set(::GetCurrentThread(), wide(name).c_str());
}

int usable_cores() {
  DWORD_PTR ours = 0, all = 0;
  if (::GetProcessAffinityMask(::GetCurrentProcess(), &ours, &all) != 0 && ours != 0)
    return std::popcount(std::uint64_t{ours});
  return std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
}

void prioritise_audio_thread() {
  ::SetThreadPriority(::GetCurrentThread(), THREAD_PRIORITY_TIME_CRITICAL);
}

// Windows has such clocks of the calling thread only.
std::optional<clockid_t> clock_of_this_thread() noexcept { return std::nullopt; }

// Windows has no requests to cancel a thread.
CancellationDelay::CancellationDelay() noexcept = default;
CancellationDelay::~CancellationDelay() = default;

}  // namespace clamor
