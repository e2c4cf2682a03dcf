// hdf5_writer.h: writes heads by libhdf5, in legal forms that libmysofa does not read.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "tests/sofa_writer.h"

namespace clamor::testing {

struct Hdf5Form {
  const char* type = "H5T_IEEE_F64LE_g";  // of Data.IR
  bool deflated = false;                  // without shuffle
  bool variable_text = false;             // as h5py writes attributes
};

// Needs load_hdf5(), which leaves the library loaded.
class Hdf5Writer {
 public:
  Hdf5Writer(const std::string& path, const SofaContent& content, const Hdf5Form& form)
      : form_(form) {
    for (const char* name : {"libhdf5_serial.so.103", "libhdf5_serial.so.310", "libhdf5.so.103",
                             "libhdf5.so.200", "libhdf5.so.310", "libhdf5.so"})
      if (library_ == nullptr) library_ = ::dlopen(name, RTLD_NOW | RTLD_NOLOAD);
    EXPECT_NE(library_, nullptr);
    call<int()>("H5open")();
    file_ = call<Id(const char*, unsigned, Id, Id)>("H5Fcreate")(path.c_str(), 2, 0, 0);
    EXPECT_GE(file_, 0);
    text(file_, "SOFAConventions", content.convention);
    text(file_, "DataType", content.data_type);
    const std::uint64_t count = content.directions.size();
    std::vector<double> places;
    for (const Vec3& d : content.directions) places.insert(places.end(), {d.x, d.y, d.z});
    text(table("SourcePosition", {count, 3}, places), "Type", "cartesian");
    text(table("ReceiverPosition", {2, 3, 1}, {0, 0.09, 0, 0, -0.09, 0}), "Type", "cartesian");
    text(table("ListenerView", {1, 3}, {1, 0, 0}), "Type", "cartesian");
    table("ListenerUp", {1, 3}, {0, 0, 1});
    table("Data.SamplingRate", {1}, {content.rate_hz});
    table("Data.Delay", {content.delays.size() / 2, 2}, content.delays);
    table("Data.IR", {count, 2, content.frames}, content.responses, true);
    call<int(Id)>("H5Fclose")(file_);
  }

 private:
  using Id = std::int64_t;

  template <class Function>
  Function* call(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(library_, name));
  }
  Id constant(const char* name) { return *static_cast<const Id*>(::dlsym(library_, name)); }

  Id table(const char* name, const std::vector<std::uint64_t>& sizes,
           const std::vector<double>& values, bool in_form = false) {
    const std::vector<unsigned long long> extent(sizes.begin(), sizes.end());
    const int rank = static_cast<int>(extent.size());
    const Id space = call<Id(int, const unsigned long long*, const unsigned long long*)>(
        "H5Screate_simple")(rank, extent.data(), nullptr);
    const Id layout = call<Id(Id)>("H5Pcreate")(constant("H5P_CLS_DATASET_CREATE_ID_g"));
    if (in_form && form_.deflated) {
      call<int(Id, int, const unsigned long long*)>("H5Pset_chunk")(layout, rank, extent.data());
      call<int(Id, unsigned)>("H5Pset_deflate")(layout, 4);
    }
    const Id type = constant(in_form ? form_.type : "H5T_IEEE_F64LE_g");
    const Id made = call<Id(Id, const char*, Id, Id, Id, Id, Id)>("H5Dcreate2")(
        file_, name, type, space, 0, layout, 0);
    EXPECT_GE(call<int(Id, Id, Id, Id, Id, const void*)>("H5Dwrite")(
                  made, constant("H5T_NATIVE_DOUBLE_g"), 0, 0, 0, values.data()),
              0);
    return made;
  }

  void text(Id object, const char* name, const std::string& value) {
    const Id type = call<Id(Id)>("H5Tcopy")(constant("H5T_C_S1_g"));
    const std::size_t size = form_.variable_text ? ~std::size_t{0} : value.size();
    call<int(Id, std::size_t)>("H5Tset_size")(type, size);
    const Id space = call<Id(int)>("H5Screate")(0);
    const Id made =
        call<Id(Id, const char*, Id, Id, Id, Id)>("H5Acreate2")(object, name, type, space, 0, 0);
    const char* const pointer = value.c_str();
    const void* from = form_.variable_text ? static_cast<const void*>(&pointer) : pointer;
    EXPECT_GE((call<int(Id, Id, const void*)>("H5Awrite")(made, type, from)), 0);
  }

  Hdf5Form form_;
  void* library_ = nullptr;
  Id file_ = -1;
};

}  // namespace clamor::testing
