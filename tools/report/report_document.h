// report_document.h: the document of clamor report, which its page draws (page/report.js).
//
// It answers what a room sounds like and whether anything is wrong with its bake, first in a
// sentence, then with a view that can be walked through, then with figures.
#pragma once

#include <optional>
#include <vector>

#include "tools/analysis/json_values.h"
#include "tools/report/floor_map.h"
#include "tools/report/room.h"
#include "tools/report/room_response.h"

namespace clamor {

// Measurements of one bake.
struct MeasuredRoom {
  const RoomMeter* meter = nullptr;
  std::vector<RoomResponse> responses;  // one per listener

  const BakeFile& file() const { return *meter->room().file; }
};

struct ReportContents {
  MeasuredRoom measured;
  std::optional<MeasuredRoom> other;  // another bake, at the same listeners
  FloorMap map;
  std::optional<RoomParameters> map_at_first;  // what the map's sample gives at the first listener
};

// The Error names the file and the part of it that cannot be read.
Result<OrderedJson> report_document(const ReportContents& contents);

}  // namespace clamor
