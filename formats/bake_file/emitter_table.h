// emitter_table.h: compresses the emitter table of a bake file by instancing.
//
// The table of 16 416 fans takes 2.4 MB, half of the file of their stadium, and for instanced
// stands nearly all of it is redundant. So a run of emitters may be stored as an instance of an
// earlier run, with a transform, a delay and a signal map. Readers expand the table, up to limits
// that depend on the size of the file.
//
// A run is only instanced if its emitters are reproduced within 0.5 mm, 1e-4 rad, 0.001 dB and 2
// us. Names are exact.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/instance.h"

namespace clamor {

struct BakeContents;
struct Emitter;

struct EmitterInstance {
  std::uint32_t at = 0, from = 0, count = 0;  // indices in the table; from + count <= at
  Instance transform{};                       // tree, u, emitters and delay are unused
  double delay_s = 0;                         // may be negative
};

// Limits on the expanded table of a file with instanced emitters: about 700 bytes of memory per
// byte of the file, less than signals and geometry may take. All names of instanced emitters
// together may take a third of that, 62 letters each at the maximum number.
constexpr std::uint64_t max_instanced_emitters(std::uint64_t file_bytes) { return 4 * file_bytes; }
constexpr std::uint64_t max_name_bytes(std::uint64_t file_bytes) { return 250 * file_bytes; }

// Disjoint runs, in order, that instances in `contents` reproduce.
std::vector<EmitterInstance> find_emitter_instances(const BakeContents& contents);

// Returns whether the values of a run are in range, for a table that already has `run.at` emitters.
bool is_valid(const EmitterInstance& run, std::size_t signal_maps);

// The instance of an emitter, with the name of the original.
Emitter instantiate(const Emitter& emitter, const EmitterInstance& run,
                    std::span<const std::vector<std::uint32_t>> signal_maps);

// Total length of the names of all instanced emitters, inherited names included.
std::uint64_t instanced_name_bytes(std::span<const Emitter> table,
                                   std::span<const EmitterInstance> runs);

// Encodes the names of all instanced emitters; inherited names take one byte.
std::string list_names(std::span<const Emitter> table, std::span<const EmitterInstance> runs);

// Decodes the names one by one.
class NameList {
 public:
  explicit NameList(std::span<const std::byte> list) : list_(list) {}
  // Changes `name` unless it is inherited. An Error at the end of the list.
  Result<void> next(std::string& name);
  bool at_end() const { return at_ == list_.size(); }

 private:
  std::span<const std::byte> list_;
  std::size_t at_ = 0;
};

}  // namespace clamor
