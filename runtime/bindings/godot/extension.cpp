// extension.cpp: where Godot enters the add-on's library, and leaves it.
#include "common/platform/process.h"
#include "runtime/bindings/godot/baker.h"
#include "runtime/bindings/godot/engine.h"
#include "runtime/bindings/godot/listener_stream.h"
#include "runtime/bindings/godot/server.h"
#include "runtime/bindings/godot/world.h"

namespace clamor::godot {
namespace {

Object server = nullptr;

void initialize(void*, std::int32_t level) {
  if (level == kEditorLevel) load_help();
  if (level != kSceneLevel) return;
  register_listener_stream();
  register_server();
  server = make_object("ClamorServer", "Object", new char);
  Value::singleton("Engine").call("register_singleton", {"ClamorServer", Value(server)});
}

void deinitialize(void*, std::int32_t level) {
  if (level != kSceneLevel) return;
  end_baker();
  World::get().close();
  Value::singleton("Engine").call("unregister_singleton", {"ClamorServer"});
  engine.object_destroy(server);
}

}  // namespace
}  // namespace clamor::godot

#ifdef _WIN32
#define CLAMOR_GODOT_EXPORT __declspec(dllexport)
#else
#define CLAMOR_GODOT_EXPORT __attribute__((visibility("default")))
#endif

extern "C" CLAMOR_GODOT_EXPORT clamor::godot::Boolean clamor_godot_begin(
    clamor::godot::GetFunction get, void* library, clamor::godot::Initialization* initialization) {
  using namespace clamor::godot;
  if (!load_interface(get, library)) return 0;
  // Godot frees what it plays after it has unloaded extensions, so the code must stay in memory.
  clamor::loaded_library({library_path().c_str()});
  const MainLoopCallbacks callbacks = {nullptr, nullptr, [] { World::get().frame(); }};
  engine.register_main_loop_callbacks(library, &callbacks);
  *initialization = {kSceneLevel, nullptr, initialize, deinitialize};
  return 1;
}
