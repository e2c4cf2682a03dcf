// application_level.h: a level that an application makes, from nothing or on top of a level file.
//
// Everything is checked when it is added, as the import checks a file, so that the whole is a valid
// Level. Materials and sounds that nothing uses are left out of it.
//
// Threads: const functions may be called concurrently.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bounds.h"
#include "common/result.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/level_import.h"
#include "formats/level/level.h"

namespace clamor {

struct ApplicationMaterial {
  std::string name, preset;  // "": the preset's name; no preset
  // As in read_acoustic_material(): unset values are the preset's, or the defaults.
  std::optional<Bands> absorption, scattering, phong, transmission;
};

class ApplicationLevel {
 public:
  explicit ApplicationLevel(std::string name);
  static Result<ApplicationLevel> read(const std::string& path, const ImportOptions& options);

  // Return the number of what was added, from 0.
  Result<std::uint32_t> add_material(const ApplicationMaterial& values);
  Result<std::uint32_t> add_sound_file(const std::string& path, std::string name, bool loop);
  Result<std::uint32_t> add_samples(std::span<const float> samples, int rate_hz, std::string name,
                                    bool loop);

  // Three coordinates for each vertex and three indices for each triangle; no indices: the vertices
  // in their order.
  Result<void> add_triangles(std::span<const float> vertices_m,
                             std::span<const std::uint32_t> indices, std::uint32_t material);

  // `emitter.signal` is the number of an added sound.
  Result<void> add_emitter(Emitter emitter);
  Result<void> set_air(const Air& air);

  const std::string& path() const { return path_; }  // of the level file, or ""
  const ImportOptions& options() const { return options_; }
  bool is_file_alone() const { return !path_.empty() && !changed_; }

  // The numbers of triangles and so on, of the file and added.
  std::size_t materials() const { return file_.level.materials.size() + added_.materials.size(); }
  std::size_t sounds() const { return file_.level.signals.size() + added_.signals.size(); }
  std::size_t emitters() const { return file_.level.emitters.size() + added_.emitters.size(); }
  std::size_t probes() const { return file_.level.probes_m.size(); }
  std::size_t triangles() const {
    return file_.level.mesh.triangles.size() + added_.mesh.triangles.size();
  }
  Boundsf bounds() const;  // of the triangles; a point if there are none

  // The level to bake. Reads the level file again if the seed is not the one that its random delays
  // were drawn with. Sets `file_hash` to the input_hash of the file alone.
  Result<ImportedLevel> whole(std::optional<std::uint64_t> seed,
                              std::optional<std::uint64_t>& file_hash) const;

 private:
  void append_mesh(ImportedLevel& whole) const;
  void append_emitters(Level& level) const;

  std::string path_;
  ImportOptions options_;
  ImportedLevel file_;  // without a file: empty but for its name
  Level added_;
  LevelFolder folder_;  // of the added sound files
  std::size_t without_area_ = 0;
  bool changed_ = false;
};

}  // namespace clamor
