// engine.h: Godot's C interface for extensions, as far as the add-on uses it, and values of
// GDScript.
//
// Godot asks extensions to take functions by name, so that they neither link with it nor depend on
// its version: these are there from Godot 4.5 on. Structures and numbers are those of its
// gdextension_interface.h, which a test compares with them. A Value is a Variant of Godot's: it
// converts itself, calls methods by name, and frees what it holds.
//
// Threads: values may be used by any, each by one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace clamor::godot {

using Object = void*;  // of Godot's
using Boolean = std::uint8_t;
using Integer = std::int64_t;

enum Type : std::int32_t {
  kNil = 0,
  kBool = 1,
  kInt = 2,
  kFloat = 3,
  kString = 4,
  kVector3 = 9,
  kQuaternion = 15,
  kTransform = 18,
  kStringName = 21,
  kObject = 24,
  kDictionary = 27,
  kArray = 28,
  kPackedVector2Array = 35,
  kPackedVector3Array = 36,
  kAny = 100  // a result of any type, which an object that is counted must be
};

struct CallError {
  std::int32_t error, argument, expected;
};

struct PropertyInfo {
  Type type;
  void *name, *class_name;
  std::uint32_t hint;
  void* hint_string;
  std::uint32_t usage;
};

// A class that Godot creates, whose functions are those that it lacks otherwise.
struct ClassInfo {
  Boolean is_virtual, is_abstract, is_exposed, is_runtime;
  const void* icon_path;
  void* set_to_validate[7];  // functions for properties by name
  void *notification, *to_string, *reference, *unreference;
  Object (*create)(void* userdata, Boolean notifies);
  void (*free)(void* userdata, void* instance);
  void* recreate;
  void* (*get_virtual)(void* userdata, const void* name, std::uint32_t hash);
  void *get_virtual_data, *call_virtual;
  void* userdata;
};

struct MethodInfo {
  void* name;
  void* userdata;
  void (*call)(void* userdata, void* instance, const void* const* arguments, Integer count,
               void* result, CallError* error);
  void (*call_typed)(void* userdata, void* instance, const void* const* arguments, void* result);
  std::uint32_t flags;
  Boolean has_result;
  PropertyInfo* result;
  std::int32_t result_metadata;
  std::uint32_t arguments;
  PropertyInfo* argument_infos;
  std::int32_t* argument_metadata;
  std::uint32_t defaults;
  void** default_values;
};

struct MainLoopCallbacks {
  void (*startup)();
  void (*shutdown)();
  void (*frame)();
};

struct Initialization {
  std::int32_t minimum_level;
  void* userdata;
  void (*initialize)(void* userdata, std::int32_t level);
  void (*deinitialize)(void* userdata, std::int32_t level);
};
enum : std::int32_t { kSceneLevel = 2, kEditorLevel = 3 };

using Convert = void (*)(void* to, void* from);
using Destroy = void (*)(void* value);
using GetFunction = void (*(*)(const char* name))();

// Functions of Godot's, by their names.
#define CLAMOR_GODOT_FUNCTIONS(X)                                                             \
  X(variant_new_nil, void, (void*))                                                           \
  X(variant_new_copy, void, (void*, const void*))                                             \
  X(variant_destroy, void, (void*))                                                           \
  X(variant_get_type, Type, (const void*))                                                    \
  X(variant_call, void, (void*, const void*, const void* const*, Integer, void*, CallError*)) \
  X(variant_construct, void, (Type, void*, const void* const*, std::int32_t, CallError*))     \
  X(variant_set_keyed, void, (void*, const void*, const void*, Boolean*))                     \
  X(variant_get_keyed, void, (const void*, const void*, void*, Boolean*))                     \
  X(variant_get_ptr_destructor, Destroy, (Type))                                              \
  X(get_variant_from_type_constructor, Convert, (Type))                                       \
  X(get_variant_to_type_constructor, Convert, (Type))                                         \
  X(string_new_with_utf8_chars, void, (void*, const char*))                                   \
  X(string_to_utf8_chars, Integer, (const void*, char*, Integer))                             \
  X(string_name_new_with_latin1_chars, void, (void*, const char*, Boolean))                   \
  X(packed_vector2_array_operator_index_const, void*, (const void*, Integer))                 \
  X(packed_vector3_array_operator_index_const, void*, (const void*, Integer))                 \
  X(file_access_get_buffer, std::uint64_t, (Object, std::uint8_t*, std::uint64_t))            \
  X(get_library_path, void, (void*, void*))                                                   \
  X(global_get_singleton, Object, (const void*))                                              \
  X(classdb_get_method_bind, const void*, (const void*, const void*, Integer))                \
  X(object_method_bind_ptrcall, void, (const void*, Object, const void* const*, void*))       \
  X(ref_set_object, void, (void*, Object))                                                    \
  X(object_set_instance, void, (Object, const void*, void*))                                  \
  X(object_destroy, void, (Object))                                                           \
  X(object_get_instance_from_id, Object, (std::uint64_t))                                     \
  X(classdb_construct_object2, Object, (const void*))                                         \
  X(classdb_register_extension_class5, void, (void*, const void*, const void*, ClassInfo*))   \
  X(classdb_register_extension_class_method, void, (void*, const void*, const MethodInfo*))   \
  X(editor_help_load_xml_from_utf8_chars, void, (const char*))                                \
  X(register_main_loop_callbacks, void, (void*, const MainLoopCallbacks*))                    \
  X(print_error, void, (const char*, const char*, const char*, std::int32_t, Boolean))

struct Interface {
#define CLAMOR_GODOT_MEMBER(name, result, arguments) result(*name) arguments;
  CLAMOR_GODOT_FUNCTIONS(CLAMOR_GODOT_MEMBER)
#undef CLAMOR_GODOT_MEMBER
  void* library;
};
extern Interface engine;

// Looks up all functions; false if Godot lacks one, because it is too old.
bool load_interface(GetFunction get, void* library);

// A StringName of Godot's.
class Name {
 public:
  explicit Name(const char* text) { engine.string_name_new_with_latin1_chars(&data_, text, 0); }
  Name(const Name&) = delete;
  Name& operator=(const Name&) = delete;
  ~Name();
  void* get() { return &data_; }

 private:
  void* data_;
};

struct Vector3 {
  float x, y, z;
};
struct Quaternion {
  float x, y, z, w;
};
struct Transform {
  Vector3 rows[3], origin;
};

class Value {
 public:
  Value() { engine.variant_new_nil(data_); }
  Value(const Value& other) { engine.variant_new_copy(data_, other.data_); }
  Value(bool value) : Value(kBool, Boolean(value)) {}
  Value(int value) : Value(kInt, Integer(value)) {}
  Value(Integer value) : Value(kInt, value) {}
  Value(double value) : Value(kFloat, value) {}
  Value(Object value) : Value(kObject, value) {}
  Value(const Vector3& value) : Value(kVector3, value) {}
  Value(const char* text);
  Value(const std::string& text) : Value(text.c_str()) {}
  static Value empty(Type type);  // a Dictionary or an Array
  static Value singleton(const char* name);
  Value& operator=(const Value& other);
  ~Value() { engine.variant_destroy(data_); }

  Type type() const { return engine.variant_get_type(data_); }
  bool to_bool() const { return to<Boolean>(kBool) != 0; }
  Integer to_int() const { return to<Integer>(kInt); }
  double to_float() const { return to<double>(kFloat); }
  Object to_object() const { return to<Object>(kObject); }
  Vector3 to_vector() const { return to<Vector3>(kVector3); }
  Quaternion to_quaternion() const { return to<Quaternion>(kQuaternion); }
  Transform to_transform() const { return to<Transform>(kTransform); }
  std::string to_text() const;
  // Elements of a packed array of vectors, `dimensions` floats each.
  std::vector<float> to_floats(Type type, int dimensions) const;

  // Calls a method by name; nil if there is none.
  Value call(const char* method, std::initializer_list<Value> arguments = {}) const;
  Value operator[](const char* key) const;
  void set(const char* key, const Value& value);
  void* raw() { return data_; }

 private:
  template <class T>
  Value(Type type, T value) {
    engine.get_variant_from_type_constructor(type)(data_, &value);
  }
  template <class T>
  T to(Type type) const {
    T value{};
    engine.get_variant_to_type_constructor(type)(&value, const_cast<std::byte*>(data_));
    return value;
  }

  alignas(8) std::byte data_[24];  // of a Variant, without numbers of double precision
};

// A method of a class, as GDScript and Godot's help know it. The text is for the help.
struct Method {
  const char *name, *text;
  Type result;
  std::vector<std::pair<const char*, Type>> arguments;
  Value (*run)(void* self, const Value* const* arguments);
};

// Tells Godot a class. `create` makes an instance for a new object of Godot's, which `destroy` gets
// at its end; `find_virtual` returns the function for a virtual method, or null.
struct Class {
  const char *name, *parent, *text;
  void* (*create)();
  void (*destroy)(void* instance);
  void* (*find_virtual)(const std::string& name);
  std::vector<Method> methods;
};
void register_class(const Class& description);
// Gives the texts of all classes to Godot's help. In the editor alone, once it is there.
void load_help();

// The path of this library or, given a name, of a file beside it, as the system writes paths.
std::string library_path(const char* beside = nullptr);

// Where a Node3D in the tree is.
Transform global_transform(Object node);

// A new object of a class that was registered with this parent.
Object make_object(const char* name, const char* parent, void* instance);

}  // namespace clamor::godot
