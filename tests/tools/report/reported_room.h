// reported_room.h: a baked room in a file, as a report reads it.
#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/report/level_report.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/rooms.h"
#include "tests/tools/run_clamor.h"
#include "tools/report/room.h"

namespace clamor::testing {

// Bakes a level with its warnings, as clamor bake does, and reads it.
class ReportedRoom {
 public:
  explicit ReportedRoom(Level level, std::uint64_t photons = 1000, std::uint64_t sources = 20'000) {
    const LevelReport report = prepare_level(level);
    BakeOptions options;
    options.settings.photons = photons;
    options.settings.sources = sources;
    options.threads = 1;
    auto contents = bake(level, options);
    EXPECT_TRUE(contents.ok());
    contents->provenance.level = "room.glb";
    contents->statistics.warnings = report_warnings(report);
    contents->statistics.findings = findings_in(report);
    EXPECT_TRUE(write_bake(path(), *contents, 1).ok());
    auto file = BakeFile::open(path());
    EXPECT_TRUE(file.ok());
    file_ = std::make_unique<BakeFile>(std::move(*file));
  }

  std::string path() const { return folder_ / "room.clamor"; }
  const Folder& folder() const { return folder_; }
  const BakeFile& file() const { return *file_; }
  Room room(std::size_t max_sources = Room::kMaxSources) const {
    return std::move(*Room::read(*file_, max_sources));
  }

 private:
  Folder folder_;
  std::unique_ptr<BakeFile> file_;
};

}  // namespace clamor::testing
