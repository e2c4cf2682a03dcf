// process.cpp: processes and their libraries by Windows.
#include "common/platform/process.h"

#include <cstdio>

#include <fcntl.h>
#include <io.h>

#include "common/platform/windows/win32.h"

namespace clamor {

std::string host_name() {
  DWORD size = 0;
  ::GetComputerNameExW(ComputerNameDnsHostname, nullptr, &size);
  std::wstring name(size, L'\0');
  if (size == 0 || ::GetComputerNameExW(ComputerNameDnsHostname, name.data(), &size) == 0)
    return "";
  name.resize(size);
  return narrow(name);
}

int process_id() { return static_cast<int>(::GetCurrentProcessId()); }

bool has_ended(int process) {
  const HANDLE handle = ::OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process));
  if (handle == nullptr) return ::GetLastError() == ERROR_INVALID_PARAMETER;
  const bool ended = ::WaitForSingleObject(handle, 0) == WAIT_OBJECT_0;
  ::CloseHandle(handle);
  return ended;
}

std::optional<std::string> make_temporary_folder(std::string pattern) {
  const bool made = try_names(pattern, [](const std::string& path) {
    return ::CreateDirectoryW(wide_path(path).c_str(), nullptr) != 0 || fail_by_last_error();
  });
  return made ? std::optional(pattern) : std::nullopt;
}

void call_in_forks(void (*)()) {}

std::vector<std::string> program_arguments(int, char**) {
  int count = 0;
  wchar_t** const words = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  std::vector<std::string> arguments;
  for (int i = 1; i < count; ++i) arguments.push_back(narrow(words[i]));
  ::LocalFree(words);
  return arguments;
}

void prepare_to_write() {
  // Outputs are UTF-8, with the line ends that other systems write and colours by escape sequences.
  ::SetConsoleOutputCP(CP_UTF8);
  for (const int number : {1, 2}) {
    ::_setmode(number, _O_BINARY);
    const HANDLE console = reinterpret_cast<HANDLE>(::_get_osfhandle(number));
    DWORD mode = 0;
    if (::GetConsoleMode(console, &mode) != 0)
      ::SetConsoleMode(console, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
  }
}

void* loaded_library(std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const HMODULE library = ::LoadLibraryW(wide(name).c_str())) return library;
  return nullptr;
}

void* symbol_in(void* library, const char* name) {
  const HMODULE module =
      library != nullptr ? static_cast<HMODULE>(library) : ::GetModuleHandleW(nullptr);
  return reinterpret_cast<void*>(::GetProcAddress(module, name));
}

}  // namespace clamor
