#include "formats/audio/hdf5_file.h"

#include <array>

#include "common/memory_size.h"
#include "common/platform/process.h"

namespace clamor {

namespace {

// The part of libhdf5's interface that is used, as since version 1.10.
using Id = std::int64_t;  // hid_t; negative for an error
constexpr Id kDefault = 0;
constexpr int kStringClass = 3;
constexpr std::size_t kMaxText = 256;
constexpr int kMaxRank = 4;

struct Library {
  int (*open)();
  int (*set_error_handler)(Id stack, void* function, void* data);
  Id (*open_file)(const char* name, unsigned flags, Id access);
  int (*exists)(Id place, const char* name, Id access);
  Id (*open_table)(Id place, const char* name, Id access);
  Id (*space_of_table)(Id table);
  int (*rank)(Id space);
  int (*sizes)(Id space, unsigned long long* sizes, unsigned long long* max_sizes);
  std::int64_t (*points)(Id space);
  int (*read_table)(Id table, Id type, Id memory, Id file, Id transfer, void* values);
  int (*has_attribute)(Id place, const char* object, const char* name, Id access);
  Id (*open_attribute)(Id place, const char* object, const char* name, Id opening, Id access);
  Id (*type_of_attribute)(Id attribute);
  Id (*space_of_attribute)(Id attribute);
  int (*class_of)(Id type);
  std::size_t (*size_of)(Id type);
  int (*is_variable)(Id type);
  int (*read_attribute)(Id attribute, Id type, void* value);
  const Id* native_float;
};

template <class T>
bool find(void* handle, const char* name, T& symbol) {
  symbol = reinterpret_cast<T>(symbol_in(handle, name));
  return symbol != nullptr;
}

const Library* library() {
  static const std::optional<Library> loaded = []() -> std::optional<Library> {
    void* const handle =
        loaded_library({"libhdf5_serial.so.103", "libhdf5_serial.so.310", "libhdf5.so.103",
                        "libhdf5.so.200", "libhdf5.so.310", "libhdf5.so"});
    if (handle == nullptr) return std::nullopt;
    Library of{};
    const bool complete =
        find(handle, "H5open", of.open) && find(handle, "H5Eset_auto2", of.set_error_handler) &&
        find(handle, "H5Fopen", of.open_file) && find(handle, "H5Lexists", of.exists) &&
        find(handle, "H5Dopen2", of.open_table) &&
        find(handle, "H5Dget_space", of.space_of_table) &&
        find(handle, "H5Sget_simple_extent_ndims", of.rank) &&
        find(handle, "H5Sget_simple_extent_dims", of.sizes) &&
        find(handle, "H5Sget_simple_extent_npoints", of.points) &&
        find(handle, "H5Dread", of.read_table) &&
        find(handle, "H5Aexists_by_name", of.has_attribute) &&
        find(handle, "H5Aopen_by_name", of.open_attribute) &&
        find(handle, "H5Aget_type", of.type_of_attribute) &&
        find(handle, "H5Aget_space", of.space_of_attribute) &&
        find(handle, "H5Tget_class", of.class_of) && find(handle, "H5Tget_size", of.size_of) &&
        find(handle, "H5Tis_variable_str", of.is_variable) &&
        find(handle, "H5Aread", of.read_attribute) &&
        find(handle, "H5T_NATIVE_FLOAT_g", of.native_float);
    if (!complete) return std::nullopt;
    return of;
  }();
  return loaded ? &*loaded : nullptr;
}

}  // namespace

bool load_hdf5() { return library() != nullptr; }

std::optional<Hdf5File> Hdf5File::open(const std::string& path) {
  const Library* hdf5 = library();
  if (hdf5 == nullptr || hdf5->open() < 0) return std::nullopt;
  hdf5->set_error_handler(kDefault, nullptr, nullptr);  // it would print
  const Id id = hdf5->open_file(path.c_str(), 0, kDefault);
  if (id < 0) return std::nullopt;
  return Hdf5File(id);
}

std::string Hdf5File::text(const char* object, const char* attribute) const {
  const Library& hdf5 = *library();
  if (hdf5.has_attribute(id_, object, attribute, kDefault) <= 0) return "";
  const Id id = hdf5.open_attribute(id_, object, attribute, kDefault, kDefault);
  if (id < 0) return "";
  const Id type = hdf5.type_of_attribute(id);
  const Id space = hdf5.space_of_attribute(id);
  if (type < 0 || space < 0 || hdf5.class_of(type) != kStringClass || hdf5.points(space) != 1)
    return "";
  if (hdf5.is_variable(type) > 0) {
    const char* value = nullptr;
    return hdf5.read_attribute(id, type, &value) < 0 || value == nullptr ? "" : value;
  }
  std::array<char, kMaxText + 1> value{};
  if (hdf5.size_of(type) > kMaxText || hdf5.read_attribute(id, type, value.data()) < 0) return "";
  return value.data();
}

std::optional<Hdf5Table> Hdf5File::table(const char* name, std::uint64_t max_values) const {
  const Library& hdf5 = *library();
  if (hdf5.exists(id_, name, kDefault) <= 0) return std::nullopt;
  const Id id = hdf5.open_table(id_, name, kDefault);
  const Id space = id < 0 ? id : hdf5.space_of_table(id);
  if (space < 0) return std::nullopt;
  const int rank = hdf5.rank(space);
  if (rank < 0 || rank > kMaxRank) return std::nullopt;
  std::array<unsigned long long, kMaxRank> sizes{};
  if (hdf5.sizes(space, sizes.data(), nullptr) < 0) return std::nullopt;
  Hdf5Table table;
  std::uint64_t values = 1;
  for (int i = 0; i < rank; ++i) {
    const std::uint64_t size = sizes[static_cast<std::size_t>(i)];
    if (size > max_values || values * size > max_values) return std::nullopt;
    values *= size;
    table.sizes.push_back(size);
  }
  table.values.resize(memory_size(values));
  if (hdf5.read_table(id, *hdf5.native_float, kDefault, kDefault, kDefault, table.values.data()) <
      0)
    return std::nullopt;
  return table;
}

}  // namespace clamor
