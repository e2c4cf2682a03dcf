// hdf5_file.h: reads tables of numbers from HDF5 files by libhdf5, where it is installed.
//
// libmysofa reads the HDF5 that netCDF-4 writes by default, and misreads or refuses other legal
// files: numbers of 32 bits, integers, deflate without shuffle, and what h5py and h5repack write.
// For those, libhdf5 is loaded at run time (Debian: hdf5-tools brings it). It is not linked, because it
// brings 30 libraries along (curl, OpenSSL, LDAP, Kerberos), which no game should load to render
// for headphones; so no package of ours depends on it.
//
// Threads: load_hdf5() any; Hdf5File in one, in a process that ends soon, because nothing is
// closed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace clamor {

// Loads libhdf5 once. Returns whether it is there.
bool load_hdf5();

struct Hdf5Table {
  std::vector<std::uint64_t> sizes;
  std::vector<float> values;
};

class Hdf5File {
 public:
  // Needs load_hdf5().
  static std::optional<Hdf5File> open(const std::string& path);

  // The text of an attribute of an object ("/" for the file itself); empty if there is none.
  std::string text(const char* object, const char* attribute) const;

  // A data set of at most `max_values` numbers of any type.
  std::optional<Hdf5Table> table(const char* name, std::uint64_t max_values) const;

 private:
  explicit Hdf5File(std::int64_t id) : id_(id) {}

  std::int64_t id_;
};

}  // namespace clamor
