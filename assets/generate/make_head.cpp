// make_head.cpp: fits an HRTF to the measurement in a SOFA file and writes it as the program embeds
// it: make_head MEASUREMENT.sofa assets/heads/kemar.head
#include <cstddef>
#include <fstream>
#include <iostream>
#include <vector>

#include "runtime/hrtf/hrtf.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "make_head MEASUREMENT.sofa OUTPUT.head\n";
    return 2;
  }
  const auto head = clamor::Hrtf::read(argv[1]);
  if (!head.ok()) {
    std::cerr << "make_head: " << head.error().message << '\n';
    return 1;
  }
  const std::vector<std::byte> bytes = (*head)->stored();
  std::ofstream file(argv[2], std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file) return 0;
  std::cerr << argv[2] << ": cannot be written. Is the folder there, the disk full?\n";
  return 1;
}
