// main.cpp: the program `clamor`.
#include <exception>
#include <iostream>

#include "common/platform/process.h"
#include "common/printable.h"
#include "common/system_reason.h"
#include "tools/commands/commands.h"

int main(int argc, char** argv) {
  clamor::prepare_to_write();
  try {
    return clamor::run_clamor(clamor::program_arguments(argc, argv), std::cout, std::cerr);
  } catch (const std::bad_alloc&) {
    std::cerr << "clamor: out of memory; try fewer photons or voices, or a smaller level\n";
  } catch (const std::exception& exception) {
    std::cerr << "clamor: " << clamor::printable(clamor::system_reason(exception)) << '\n';
  }
  return clamor::kBadInput;
}
