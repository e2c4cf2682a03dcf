// emitter_table.h: the emitters of a bake file, those of copied groups told by what they copy.
//
// A table of 16 416 fans takes 2.4 MB, half of their stadium's file, and where stands of fans are
// copies nearly all of it says again what the copies say. So a run of emitters may be told as a
// copy of an earlier run: where to, by which turn, how much later, playing which signals. Readers
// make the whole table of it, as long as the file is not small for so many.
//
// What such an emitter comes out as differs from what it was by at most 0.5 mm, 1e-4 rad, 0.001 dB
// and 2 us; else it is not told so. Names are kept as they were.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/instance.h"

namespace clamor {

struct EmitterInstance {
  std::uint32_t at = 0, from = 0, count = 0;  // places in the table; from + count <= at
  Instance copy{};                            // but for tree, number, emitters and delay
  double delay_s = 0;                         // may be less than 0
};

// The table of a file of so many bytes may have so many emitters, if some of them are copies: some
// 700 bytes of memory for each of the file, less than signals and geometry may take. The names of
// all copies together, those that they take over included, may take a third of that: 62 letters
// each where there are as many as can be.
constexpr std::uint64_t max_instanced_emitters(std::uint64_t file_bytes) { return 4 * file_bytes; }
constexpr std::uint64_t max_name_bytes(std::uint64_t file_bytes) { return 250 * file_bytes; }

// Runs that the copies in `contents` account for, in order and apart.
std::vector<EmitterInstance> find_emitter_instances(const BakeContents& contents);

// Whether the numbers of a copy are in range, for a table that has `copy.at` emitters already.
bool is_valid(const EmitterInstance& copy, std::size_t signal_maps);

// The emitter that is a copy of this one, by that one's name.
Emitter copied(const Emitter& emitter, const EmitterInstance& copy,
               std::span<const std::vector<std::uint32_t>> signal_maps);

// How long the names of all copied emitters are, those that they take over included.
std::uint64_t instanced_name_bytes(std::span<const Emitter> table,
                                   std::span<const EmitterInstance> copies);

// The names of all copied emitters, short where they are those of what is copied.
std::string list_names(std::span<const Emitter> table, std::span<const EmitterInstance> copies);

// Takes names off such a list, one by one.
class NameList {
 public:
  explicit NameList(std::span<const std::byte> list) : list_(list) {}
  // Sets `name`, if it is another than that of what is copied; an Error at the end of the list.
  Result<void> next(std::string& name);
  bool at_end() const { return at_ == list_.size(); }

 private:
  std::span<const std::byte> list_;
  std::size_t at_ = 0;
};

}  // namespace clamor
