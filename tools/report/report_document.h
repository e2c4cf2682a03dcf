// report_document.h: the page of clamor report.
//
// It answers what a room sounds like and whether anything is wrong with its bake, first in a
// sentence, then with a view that can be walked through, then with figures. All of it but the view
// is there without WebGL, and the charts and their tables without scripts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/report/bake_overview.h"
#include "tools/report/floor_map.h"
#include "tools/report/level_findings.h"
#include "tools/report/room.h"
#include "tools/report/room_response.h"
#include "tools/report/view_json.h"

namespace clamor {

// What was measured in one bake.
struct MeasuredRoom {
  const RoomMeter* meter = nullptr;
  std::vector<RoomResponse> responses;  // one per listener

  const BakeFile& file() const { return *meter->room().file; }
};

struct ReportContents {
  MeasuredRoom measured;
  std::optional<MeasuredRoom> other;  // another bake, at the same listeners
  BakeOverview overview;
  std::vector<LevelFinding> findings;
  FloorMap map;
  std::optional<RoomParameters> map_at_first;  // what the map's sample gives at the first listener
  RoomView view;
};

std::string report_html(const ReportContents& contents);

}  // namespace clamor
