// prefault_code.cpp: the code of programs and libraries of Windows.
#include "common/platform/prefault_code.h"

#include <algorithm>
#include <array>

#include "common/platform/windows/win32.h"

namespace clamor {

namespace {

constexpr std::size_t kPage_bytes = 4096;

// Reads one byte of each readable page of the image.
void touch(HMODULE image) {
  MODULEINFO module{};
  if (::K32GetModuleInformation(::GetCurrentProcess(), image, &module, sizeof module) == 0) return;
  const auto* const begin = static_cast<const char*>(module.lpBaseOfDll);
  const auto* const end = begin + module.SizeOfImage;
  MEMORY_BASIC_INFORMATION region{};
  for (const char* at = begin;
       at < end && ::VirtualQuery(at, &region, sizeof region) == sizeof region;) {
    const auto* const next =
        std::min(static_cast<const char*>(region.BaseAddress) + region.RegionSize, end);
    if (region.State == MEM_COMMIT && (region.Protect & (PAGE_GUARD | PAGE_NOACCESS)) == 0)
      for (; at < next; at += kPage_bytes)
        static_cast<void>(*static_cast<const volatile char*>(at));
    at = next;
  }
}

}  // namespace

void prefault_code() {
  std::array<HMODULE, 512> images{};
  DWORD bytes = 0;
  if (::K32EnumProcessModules(::GetCurrentProcess(), images.data(), sizeof images, &bytes) == 0)
    return;
  const std::size_t count = std::min(bytes / sizeof(HMODULE), images.size());
  for (std::size_t i = 0; i < count; ++i) touch(images[i]);
}

void prefault_library_code() {
  HMODULE image = nullptr;
  if (::GetModuleHandleExW(
          GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
          reinterpret_cast<LPCWSTR>(&prefault_library_code), &image) != 0)
    touch(image);
}

}  // namespace clamor
