// interface_check.cc: compiles if engine.h declares Godot's structures and functions as Godot's
// own header does, gdextension_interface.h, which `godot --dump-gdextension-interface` writes.
#include <cstddef>
#include <type_traits>

#include "gdextension_interface.h"
#include "runtime/bindings/godot/engine.h"

namespace clamor::godot {
namespace {

#define SAME_SIZE(ours, theirs) static_assert(sizeof(ours) == sizeof(theirs))
#define SAME_PLACE(ours, member, theirs, their_member) \
  static_assert(offsetof(ours, member) == offsetof(theirs, their_member))

SAME_SIZE(CallError, GDExtensionCallError);
SAME_SIZE(PropertyInfo, GDExtensionPropertyInfo);
SAME_PLACE(PropertyInfo, hint, GDExtensionPropertyInfo, hint);
SAME_PLACE(PropertyInfo, usage, GDExtensionPropertyInfo, usage);
SAME_SIZE(ClassInfo, GDExtensionClassCreationInfo5);
SAME_PLACE(ClassInfo, is_exposed, GDExtensionClassCreationInfo5, is_exposed);
SAME_PLACE(ClassInfo, notification, GDExtensionClassCreationInfo5, notification_func);
SAME_PLACE(ClassInfo, create, GDExtensionClassCreationInfo5, create_instance_func);
SAME_PLACE(ClassInfo, free, GDExtensionClassCreationInfo5, free_instance_func);
SAME_PLACE(ClassInfo, get_virtual, GDExtensionClassCreationInfo5, get_virtual_func);
SAME_PLACE(ClassInfo, userdata, GDExtensionClassCreationInfo5, class_userdata);
SAME_SIZE(MethodInfo, GDExtensionClassMethodInfo);
SAME_PLACE(MethodInfo, call, GDExtensionClassMethodInfo, call_func);
SAME_PLACE(MethodInfo, call_typed, GDExtensionClassMethodInfo, ptrcall_func);
SAME_PLACE(MethodInfo, flags, GDExtensionClassMethodInfo, method_flags);
SAME_PLACE(MethodInfo, result, GDExtensionClassMethodInfo, return_value_info);
SAME_PLACE(MethodInfo, arguments, GDExtensionClassMethodInfo, argument_count);
SAME_PLACE(MethodInfo, default_values, GDExtensionClassMethodInfo, default_arguments);
SAME_SIZE(MainLoopCallbacks, GDExtensionMainLoopCallbacks);
SAME_PLACE(MainLoopCallbacks, frame, GDExtensionMainLoopCallbacks, frame_func);
SAME_SIZE(Initialization, GDExtensionInitialization);
SAME_PLACE(Initialization, deinitialize, GDExtensionInitialization, deinitialize);

static_assert(int(kVector3) == GDEXTENSION_VARIANT_TYPE_VECTOR3);
static_assert(int(kQuaternion) == GDEXTENSION_VARIANT_TYPE_QUATERNION);
static_assert(int(kTransform) == GDEXTENSION_VARIANT_TYPE_TRANSFORM3D);
static_assert(int(kStringName) == GDEXTENSION_VARIANT_TYPE_STRING_NAME);
static_assert(int(kObject) == GDEXTENSION_VARIANT_TYPE_OBJECT);
static_assert(int(kDictionary) == GDEXTENSION_VARIANT_TYPE_DICTIONARY);
static_assert(int(kArray) == GDEXTENSION_VARIANT_TYPE_ARRAY);
static_assert(int(kPackedVector2Array) == GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR2_ARRAY);
static_assert(int(kPackedVector3Array) == GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR3_ARRAY);
static_assert(int(kSceneLevel) == GDEXTENSION_INITIALIZATION_SCENE);

}  // namespace
}  // namespace clamor::godot
