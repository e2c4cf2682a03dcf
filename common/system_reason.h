// system_reason.h: why the operating system refused something, in words that name a limit where one
// was reached.
#pragma once

#include <exception>
#include <string>

namespace clamor {

// The words for an errno, as "Permission denied". Where a limit of files, threads or processes was
// reached, they name it and how to raise it.
std::string system_reason(int code);

// The text of an exception, with the limit where threads or files could not be had.
std::string system_reason(const std::exception& thrown);

}  // namespace clamor
