#include "runtime/bindings/godot/engine.h"

#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <type_traits>

namespace clamor::godot {
namespace {

Destroy destructor_of(Type type) { return engine.variant_get_ptr_destructor(type); }

void call(void* userdata, void* instance, const void* const* arguments, Integer count, void* result,
          CallError* error) {
  const auto& method = *static_cast<const Method*>(userdata);
  if (count != Integer(method.arguments.size())) {
    *error = {count < Integer(method.arguments.size()) ? 4 : 3, 0,
              std::int32_t(method.arguments.size())};
    return;
  }
  *static_cast<Value*>(result) =
      method.run(instance, reinterpret_cast<const Value* const*>(arguments));
}

// As call(), with arguments and a result that are no Variants.
void call_typed(void* userdata, void* instance, const void* const* arguments, void* result) {
  const auto& method = *static_cast<const Method*>(userdata);
  std::vector<Value> values(method.arguments.size());
  std::vector<const Value*> pointers;
  for (std::size_t i = 0; i < values.size(); ++i) {
    engine.get_variant_from_type_constructor(method.arguments[i].second)(
        values[i].raw(), const_cast<void*>(arguments[i]));
    pointers.push_back(&values[i]);
  }
  Value value = method.run(instance, pointers.data());
  if (method.result == kNil) return;
  if (method.result == kAny) {
    *static_cast<Value*>(result) = value;
    return;
  }
  if (const Destroy destroy = destructor_of(method.result)) destroy(result);
  engine.get_variant_to_type_constructor(method.result)(result, value.raw());
}

Object create(void* userdata, Boolean) {
  const auto& description = *static_cast<const Class*>(userdata);
  return make_object(description.name, description.parent, description.create());
}

void destroy(void* userdata, void* instance) {
  static_cast<const Class*>(userdata)->destroy(instance);
}

void* find_virtual(void* userdata, const void* name, std::uint32_t) {
  const auto& description = *static_cast<const Class*>(userdata);
  if (description.find_virtual == nullptr) return nullptr;
  Value text;
  engine.get_variant_from_type_constructor(kStringName)(text.raw(), const_cast<void*>(name));
  return description.find_virtual(text.to_text());
}

constexpr std::uint32_t kDefaultUsage = 6, kNilIsAny = 1u << 17;

const char* name_of(Type type) {
  switch (type) {
    case kNil:
      return "void";
    case kBool:
      return "bool";
    case kInt:
      return "int";
    case kFloat:
      return "float";
    case kString:
      return "String";
    case kVector3:
      return "Vector3";
    case kQuaternion:
      return "Quaternion";
    case kTransform:
      return "Transform3D";
    case kObject:
      return "Object";
    case kDictionary:
      return "Dictionary";
    case kArray:
      return "Array";
    case kPackedVector3Array:
      return "PackedVector3Array";
    default:
      return "Variant";
  }
}

// A class in the XML of Godot's help.
std::string help_of(const Class& description) {
  const auto attribute = [](const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + value + "\"";
  };
  std::string xml = "<class" + attribute("name", description.name) +
                    attribute("inherits", description.parent) + "><brief_description>" +
                    description.text + "</brief_description><description></description><methods>";
  for (const Method& method : description.methods) {
    xml += "<method" + attribute("name", method.name) + "><return" +
           attribute("type", name_of(method.result)) + "/>";
    for (std::size_t i = 0; i < method.arguments.size(); ++i)
      xml += "<param" + attribute("index", std::to_string(i)) +
             attribute("name", method.arguments[i].first) +
             attribute("type", name_of(method.arguments[i].second)) + "/>";
    xml += std::string("<description>") + method.text + "</description></method>";
  }
  return xml + "</methods></class>";
}

// Godot uses the pointers until the very end.
std::vector<const Class*>& registered() {
  static auto* classes = new std::vector<const Class*>;
  return *classes;
}

// A name and a type for Godot, with the empty texts that it reads.
struct Property {
  Name name, class_name{""};
  Value hint{""};
  void* hint_text = nullptr;
  PropertyInfo info;
  Property(const char* text, Type type)
      : name(text), info{type, name.get(), class_name.get(), 0, &hint_text, kDefaultUsage} {
    engine.get_variant_to_type_constructor(kString)(&hint_text, hint.raw());
    if (type == kAny) info.type = kNil, info.usage |= kNilIsAny;
  }
  Property(const Property&) = delete;
  ~Property() { destructor_of(kString)(&hint_text); }
};

void register_method(const char* class_name, const Method& method) {
  std::vector<std::unique_ptr<Property>> arguments;
  std::vector<PropertyInfo> infos;
  for (const auto& [name, type] : method.arguments)
    infos.push_back(arguments.emplace_back(std::make_unique<Property>(name, type))->info);
  std::vector<std::int32_t> metadata(infos.size());
  Property result("", method.result);
  Name name(method.name);
  MethodInfo info{};
  info.name = name.get();
  info.userdata = const_cast<Method*>(&method);
  info.call = call;
  info.call_typed = call_typed;
  info.flags = 1;
  info.has_result = method.result != kNil;
  info.result = &result.info;
  info.arguments = std::uint32_t(infos.size());
  info.argument_infos = infos.data();
  info.argument_metadata = metadata.data();
  engine.classdb_register_extension_class_method(engine.library, Name(class_name).get(), &info);
}

}  // namespace

Interface engine;

bool load_interface(GetFunction get, void* library) {
  engine.library = library;
  bool is_complete = true;
  const auto load = [&](const char* name, auto& function) {
    function = reinterpret_cast<std::decay_t<decltype(function)>>(get(name));
    is_complete = is_complete && function != nullptr;
  };
#define CLAMOR_GODOT_LOAD(name, result, arguments) load(#name, engine.name);
  CLAMOR_GODOT_FUNCTIONS(CLAMOR_GODOT_LOAD)
#undef CLAMOR_GODOT_LOAD
  return is_complete;
}

Name::~Name() { destructor_of(kStringName)(&data_); }

Value::Value(const char* text) {
  void* string = nullptr;
  engine.string_new_with_utf8_chars(&string, text);
  engine.get_variant_from_type_constructor(kString)(data_, &string);
  destructor_of(kString)(&string);
}

Value Value::empty(Type type) {
  Value value;
  CallError error{};
  engine.variant_construct(type, value.data_, nullptr, 0, &error);
  return value;
}

Value Value::singleton(const char* name) {
  return Value(engine.global_get_singleton(Name(name).get()));
}

Value& Value::operator=(const Value& other) {
  if (this == &other) return *this;
  engine.variant_destroy(data_);
  engine.variant_new_copy(data_, other.data_);
  return *this;
}

std::string Value::to_text() const {
  void* string = nullptr;
  engine.get_variant_to_type_constructor(kString)(&string, const_cast<std::byte*>(data_));
  std::string text(std::size_t(engine.string_to_utf8_chars(&string, nullptr, 0)), '\0');
  engine.string_to_utf8_chars(&string, text.data(), Integer(text.size()));
  destructor_of(kString)(&string);
  return text;
}

std::vector<float> Value::to_floats(Type type, int dimensions) const {
  alignas(8) std::array<std::byte, 16> array{};  // of a packed array
  const auto size = std::size_t(call("size").to_int() * dimensions);
  engine.get_variant_to_type_constructor(type)(array.data(), const_cast<std::byte*>(data_));
  std::vector<float> floats(size);
  if (size != 0) {
    const void* first = type == kPackedVector2Array
                            ? engine.packed_vector2_array_operator_index_const(array.data(), 0)
                            : engine.packed_vector3_array_operator_index_const(array.data(), 0);
    std::memcpy(floats.data(), first, size * sizeof(float));
  }
  destructor_of(type)(array.data());
  return floats;
}

Value Value::call(const char* method, std::initializer_list<Value> arguments) const {
  std::vector<const void*> pointers;
  for (const Value& argument : arguments) pointers.push_back(&argument);
  Value result;
  CallError error{};
  Name name(method);
  engine.variant_call(const_cast<std::byte*>(data_), name.get(), pointers.data(),
                      Integer(pointers.size()), result.data_, &error);
  return result;
}

Value Value::operator[](const char* key) const {
  Value result;
  Boolean is_valid = 0;
  engine.variant_get_keyed(data_, Value(key).data_, result.data_, &is_valid);
  return result;
}

void Value::set(const char* key, const Value& value) {
  Boolean is_valid = 0;
  engine.variant_set_keyed(data_, Value(key).data_, value.data_, &is_valid);
}

void register_class(const Class& description) {
  const Class* const kept = registered().emplace_back(new Class(description));
  ClassInfo info{};
  info.is_exposed = 1;
  info.create = create;
  info.free = destroy;
  info.get_virtual = find_virtual;
  info.userdata = const_cast<Class*>(kept);
  Name name(kept->name), parent(kept->parent);
  engine.classdb_register_extension_class5(engine.library, name.get(), parent.get(), &info);
  for (const Method& method : kept->methods) register_method(kept->name, method);
}

void load_help() {
  for (const Class* one : registered())
    engine.editor_help_load_xml_from_utf8_chars(help_of(*one).c_str());
}

std::string library_path(const char* beside) {
  void* string = nullptr;
  engine.get_library_path(engine.library, &string);
  Value value;
  engine.get_variant_from_type_constructor(kString)(value.raw(), &string);
  destructor_of(kString)(&string);
  const std::string text = value.to_text();
  std::filesystem::path path(std::u8string(text.begin(), text.end()));
  if (beside != nullptr) path.replace_filename(beside);
  const std::u8string native = path.make_preferred().u8string();
  return {native.begin(), native.end()};
}

Transform global_transform(Object node) {
  constexpr Integer kHash = 3229777777;  // of the method's arguments and result
  static const void* const method = engine.classdb_get_method_bind(
      Name("Node3D").get(), Name("get_global_transform").get(), kHash);
  Transform transform{};
  engine.object_method_bind_ptrcall(method, node, nullptr, &transform);
  return transform;
}

Object make_object(const char* name, const char* parent, void* instance) {
  const Object object = engine.classdb_construct_object2(Name(parent).get());
  engine.object_set_instance(object, Name(name).get(), instance);
  return object;
}

}  // namespace clamor::godot
