// view_script.h: input events from a file, for demonstrations and tests: they move the mouse and
// press keys of the window, which cannot tell them from those of a person.
//
//   size 1280 720            of the window, first; 480 x 360 or more
//   move X Y                 the mouse, in pixels of the window
//   move world X Y Z         to where a point of the level is drawn
//   move "Face me"           to the middle of a control, by its label
//   press, release, click    the left mouse button; click right
//   scroll N
//   key W down, key W up, key Ctrl+Z
//   type TEXT
//   drop FILE                as if it were dropped on the window
//   wait frames N            or: wait seconds S
//   wait rebaked             another program's bake; or: wait sound, wait quick, wait final. Each
//                            may be followed by the number of seconds after which it is an error
//   screenshot FILE.ppm
//   print doors              each door, how far it has moved, and each portal, how open it is or
//                            which doors open it
//   print edit               time from the edit to the sound, what plays, time and error of the
//                            first bake, and whether it was re-weighed
//   quit
//
// One event a line, one a frame; # begins a comment. Waits last an hour or 100 000 frames at most,
// and one that ends without what it waits for is an error. So is one for what cannot come, such as
// a bake that nothing has asked for.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

// The panels leave room for the level in a window of this size.
inline constexpr int kLeastWindowWidth = 480, kLeastWindowHeight = 360;

struct ViewEvent {
  enum class Kind {
    kSize,
    kMove,
    kMoveWorld,
    kMoveTo,
    kPress,
    kRelease,
    kClick,
    kRightClick,
    kScroll,
    kKeyDown,
    kKeyUp,
    kKey,
    kType,
    kDrop,
    kWaitFrames,
    kWaitSeconds,
    kWaitSound,
    kWaitQuick,
    kWaitFinal,
    kWaitRebaked,
    kScreenshot,
    kPrint,
    kPrintDoors,
    kQuit
  };
  Kind kind = Kind::kQuit;
  double x = 0, y = 0, z = 0;  // numbers
  std::string text;            // a label, key, path or text
  int line = 0;
};

// Errors name the line, the value and its range.
Result<std::vector<ViewEvent>> parse_view_script(const std::string& text);

}  // namespace clamor
