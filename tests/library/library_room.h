// library_room.h: a context of the C interface, and a small baked room to open in it.
#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "common/listener.h"
#include "runtime/clamor.h"

namespace clamor::testing {

// Bakes of a small room, of the room without walls, and of no walls and silent sounds, each written
// once. Without walls the library builds no tree of surfaces, on threads of TBB that
// ThreadSanitizer cannot see into.
const std::string& room();
const std::string& room_without_walls();
const std::string& silent_field();
// The room with a movable part "cage", a box of 1 m that is far away at rest.
const std::string& room_with_cage();
// Two rooms with probes and without emitters: the box from the origin to (8, 4, 9) m, with a wall
// at z = 4.5 m that has a doorway between x = 3.4 and 4.6 m, as high as the rooms. The movable part
// "Door" closes it, with its hinge at x = 3.4 m; the portal "Door" fills it.
const std::string& rooms_with_door();

struct DestroysContext {
  void operator()(clamor_context* context) const { clamor_destroy(context); }
};
using Context = std::unique_ptr<clamor_context, DestroysContext>;

inline Context make_context(bool caller_updates = true) {
  clamor_options options{};
  options.bytes = sizeof(options);
  options.caller_updates = caller_updates;
  clamor_context* context = nullptr;
  EXPECT_EQ(clamor_create(&options, &context, nullptr), CLAMOR_OK);
  return Context(context);
}

inline clamor_level open_level(const Context& context, const std::string& path = room()) {
  clamor_level level = 0;
  clamor_error error;
  EXPECT_EQ(clamor_open_level(context.get(), path.c_str(), &level, &error), CLAMOR_OK)
      << error.sentence;
  return level;
}

inline clamor_pose pose_of(const Listener& listener) {
  const auto& at = listener.position_m;
  const Quaternion& turned = listener.orientation.rotation();
  return {{at.x, at.y, at.z}, {turned.x, turned.y, turned.z, turned.w}};
}

inline clamor_listener_options offline() {
  clamor_listener_options options{};
  options.bytes = sizeof(options);
  options.offline = 1;
  options.output = CLAMOR_OUTPUT_RECEIVERS;
  options.voices = 100;
  options.pose = {{2, 4, 1.6}, {}};
  return options;
}

inline clamor_listener add_listener(const Context& context, clamor_level level,
                                    const clamor_listener_options& options = offline()) {
  clamor_listener listener = 0;
  clamor_error error;
  EXPECT_EQ(clamor_create_listener(context.get(), level, &options, &listener, &error), CLAMOR_OK)
      << error.sentence;
  return listener;
}

}  // namespace clamor::testing
