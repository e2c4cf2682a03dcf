#include <limits>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "formats/files/level_folder.h"
#include "tests/formats/level_builder.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class HostileLevel : public LevelTest {
 protected:
  // A valid level with every part that the cases below break.
  void SetUp() override {
    LevelTest::SetUp();
    write("tone.wav", wav(100));
    triangle();
    const int indices = accessor(view(raw(std::vector<std::uint16_t>{0, 1, 2})), 5123, 3, "SCALAR");
    level_["meshes"][0]["primitives"][0]["indices"] = indices;
    const int values = view(raw(std::vector<float>{4, 0, 0}));
    const int places = view(raw(std::vector<std::uint32_t>{1}));
    level_["accessors"][0]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", places}, {"componentType", 5125}}},
        {"values", {{"bufferView", values}}}};
    level_["nodes"][0]["extensions"] = {
        {"EXT_mesh_gpu_instancing",
         {{"attributes", {{"TRANSLATION", floats({0, 0, 0, 9, 9, 9})}}}}},
        {"KHR_audio_emitter", {{"emitters", {0}}}},
        {"CLAMOR_emitter", {{"directivity", 2}}}};
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "tone.wav"}}}},
        {"sources", {{{"audio", 0}}}},
        {"emitters", {{{"type", "positional"}, {"sources", {0}}, {"positional", json::object()}}}}};
    level_["materials"] = {{{"name", "x"}, {"extras", {{"acoustic", "brick"}}}}};
    level_["meshes"][0]["primitives"][0]["material"] = 0;
    level_["scenes"] = {{{"nodes", {0}}}};
    level_["scene"] = 0;
    level_ = finished();
  }
};

TEST_F(HostileLevel, IsValidBeforeItIsModified) {
  const Level result = level();
  EXPECT_EQ(result.mesh.triangles.size(), 2u);
  EXPECT_EQ(result.emitters.size(), 2u);
}

// Cases: a location in the document, its new value, and words that the error must contain.
TEST_F(HostileLevel, IsRejectedWithASentence) {
  const struct {
    const char* place;
    const char* value;
    const char* part;
  } cases[] = {
      {"/asset", "{}", "version"},
      {"/asset/version", "\"1.0\"", "glTF 1.0"},
      {"/asset/version", "2", "version"},
      {"/buffers", "{}", "list"},
      {"/buffers/0", "7", "object"},
      {"/buffers/0/byteLength", "-1", "byteLength"},
      {"/buffers/0/byteLength", "1e14", "cut short"},
      {"/buffers/0/byteLength", "0.5", "byteLength"},
      {"/buffers/0/uri", "7", "uri"},
      {"/buffers/0/uri", "\"../secret.bin\"", "leads out"},
      {"/buffers/0/uri", "\"a/../../secret.bin\"", "leads out"},
      {"/buffers/0/uri", "\"/etc/passwd\"", "leads out"},
      {"/buffers/0/uri", "\"file:///etc/passwd\"", "leads out"},
      {"/buffers/0/uri", "\"http://example.com/x.bin\"", "leads out"},
      {"/buffers/0/uri", "\"%2e%2e%2fsecret.bin\"", "leads out"},
      {"/buffers/0/uri", "\"%2Fetc%2Fpasswd\"", "leads out"},
      {"/buffers/0/uri", "\"..\\\\secret.bin\"", "backslash"},
      {"/buffers/0/uri", "\"tone.wav%00.bin\"", "control"},
      {"/buffers/0/uri", "\"%zz\"", "escape"},
      {"/buffers/0/uri", "\"\"", "empty"},
      {"/buffers/0/uri", "\".\"", "folder itself"},
      {"/buffers/0/uri", "\"missing.bin\"", "cannot be read"},
      {"/buffers/0/uri", "\"data:;base64,AAAA\"", "cut short"},
      {"/buffers/0/uri", "\"data:;base64,*\"", "base64"},
      {"/buffers/0/uri", "\"data:text/plain,abc\"", "base64"},
      {"/bufferViews/0/buffer", "1", "buffer"},
      {"/bufferViews/0/buffer", "4294967296", "buffer"},
      {"/bufferViews/0/byteOffset", "1e15", "buffer 0 has only"},
      {"/bufferViews/0/byteOffset", "-4", "byteOffset"},
      {"/bufferViews/0/byteLength", "1000000", "buffer 0 has only"},
      {"/bufferViews/0/byteStride", "3", "multiple of 4"},
      {"/bufferViews/0/byteStride", "4", "stride"},
      {"/bufferViews/0/byteStride", "248", "more than fit"},
      {"/bufferViews/0/byteStride", "1e9", "byteStride"},
      {"/accessors", "7", "list"},
      {"/accessors/0/bufferView", "99", "bufferView"},
      {"/accessors/0/bufferView", "-1", "bufferView"},
      {"/accessors/0/byteOffset", "4", "more than fit"},
      {"/accessors/0/byteOffset", "900000000000000", "more than fit"},
      {"/accessors/0/componentType", "5124", "component type"},
      {"/accessors/0/componentType", "0", "componentType"},
      {"/accessors/0/type", "\"VEC2\"", "components"},
      {"/accessors/0/type", "\"VEC9\"", "type"},
      {"/accessors/0/count", "1000000000000", "more than fit"},
      {"/accessors/0/count", "2", "index 2"},
      {"/accessors/0/normalized", "7", "normalized"},
      {"/accessors/0/sparse/count", "1000000", "sparse"},
      {"/accessors/0/sparse/count", "2", "sparse"},
      {"/accessors/0/sparse/indices/bufferView", "77", "bufferView"},
      {"/accessors/0/sparse/indices/componentType", "5126", "componentType"},
      {"/accessors/0/sparse/values/byteOffset", "8", "sparse"},
      {"/accessors/0/sparse", "{}", "count"},
      {"/accessors/1/count", "4", "more than fit"},
      {"/accessors/1/componentType", "5126", "more than fit"},
      {"/accessors/1/componentType", "5120", "unsigned"},
      {"/accessors/1/componentType", "5125", "more than fit"},
      {"/accessors/2/count", "100000000000", "more than fit"},
      {"/meshes/0/primitives", "7", "primitives"},
      {"/meshes/0/primitives/0", "{}", "attributes"},
      {"/meshes/0/primitives/0/attributes/POSITION", "9", "POSITION"},
      {"/meshes/0/primitives/0/attributes/POSITION", "\"x\"", "POSITION"},
      {"/meshes/0/primitives/0/indices", "-2", "indices"},
      {"/meshes/0/primitives/0/material", "1", "material"},
      {"/meshes/0/primitives/0/mode", "7", "mode"},
      {"/nodes/0/mesh", "1", "mesh"},
      {"/nodes/0/mesh", "1e300", "mesh"},
      {"/nodes/0/children", "[0]", "reached twice"},
      {"/nodes/0/children", "[5]", "children"},
      {"/nodes/0/children", "7", "children"},
      {"/nodes/0/matrix", "[1, 2]", "16 numbers"},
      {"/nodes/0/translation", "[1, 2, \"x\"]", "3 numbers"},
      {"/nodes/0/translation", "[1e300, 0, 0]", "1000 km"},
      {"/nodes/0/scale", "[1e308, 1e308, 1e308]", "1000 km"},
      {"/nodes/0/extensions/EXT_mesh_gpu_instancing", "{}", "TRANSLATION"},
      {"/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION", "9", "accessors"},
      {"/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION", "1", "components"},
      {"/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/SCALE", "0", "another attribute"},
      {"/nodes/0/extensions/CLAMOR_emitter/directivity", "-1", "directivity"},
      {"/nodes/0/extensions/CLAMOR_emitter/directivity", "[]", "directivity"},
      {"/nodes/0/extras/clamor", "{\"probe\": \"yes\"}", "'probe' must be true or false"},
      {"/nodes/0/extras/clamor", "{\"prob\": true}", "'probe'"},
      {"/nodes/0/extras/clamor", "7", "object"},
      {"/nodes/0/extras/clamor_probe", "2", "'clamor_probe'"},
      {"/scenes/0/nodes", "[0, 0]", "reached twice"},
      {"/scenes/0/nodes", "[1]", "nodes"},
      {"/scene", "1", "scene"},
      {"/extensionsRequired", "[\"ACME_geometry\"]", "'ACME_geometry'"},
      {"/extensionsRequired", "7", "extensionsRequired"},
      {"/materials/0/extras/acoustic", "{\"absorption\": 1.5}", "from 0 to 1"},
      {"/materials/0/extras/acoustic", "{\"absorption\": [0.1, 0.2]}", "bandsHz"},
      {"/materials/0/extras/acoustic", "{\"absorbtion\": 0.1}", "'absorption'"},
      {"/materials/0/extras/acoustic", "7", "object"},
  };
  for (const auto& [place, value, part] : cases) {
    json document = level_;
    document[json::json_pointer(place)] = json::parse(value);
    const auto imported = import_level(write("level.gltf", document.dump()), {});
    ASSERT_FALSE(imported.ok()) << place << " = " << value;
    EXPECT_THAT(imported.error().message, AllOf(HasSubstr("level.gltf"), HasSubstr(part)))
        << place << " = " << value;
    EXPECT_TRUE(imported.error().message.ends_with('.')) << imported.error().message;
  }
}

// Faults of sounds cost their emitter and not the level.
TEST_F(HostileLevel, WithAFaultInItsSoundsLosesTheEmitterAndSaysWhy) {
  const struct {
    const char* place;
    const char* value;
    const char* part;
  } cases[] = {
      {"/nodes/0/extensions/KHR_audio_emitter/emitters", "[1]", "emitters"},
      {"/nodes/0/extensions/KHR_audio_emitter/emitters", "{}", "emitters"},
      {"/extensions/KHR_audio_emitter/audio/0/uri", "\"../tone.wav\"", "leads out"},
      {"/extensions/KHR_audio_emitter/audio/0/uri", "\"level.gltf\"", "no sound file"},
      {"/extensions/KHR_audio_emitter/audio/0", "{\"bufferView\": 99}", "bufferView"},
      {"/extensions/KHR_audio_emitter/audio/0", "{\"bufferView\": 0}", "no sound file"},
      {"/extensions/KHR_audio_emitter/audio/0", "{}", "neither"},
      {"/extensions/KHR_audio_emitter/sources/0/audio", "1", "audio"},
      {"/extensions/KHR_audio_emitter/sources/0/gain", "-1", "gain"},
      {"/extensions/KHR_audio_emitter/emitters/0/sources", "[3]", "sources"},
      {"/extensions/KHR_audio_emitter/emitters/0/gain", "\"loud\"", "gain"},
      {"/extensions/KHR_audio_emitter/emitters/0/positional", "7", "object"},
  };
  for (const auto& [place, value, part] : cases) {
    json document = level_;
    document[json::json_pointer(place)] = json::parse(value);
    const auto imported = import_level(write("level.gltf", document.dump()), {});
    ASSERT_TRUE(imported.ok()) << place << " = " << value << ": " << imported.error().message;
    EXPECT_TRUE(imported->level.emitters.empty()) << place << " = " << value;
    EXPECT_THAT(imported->report.warnings,
                ::testing::Contains(AllOf(HasSubstr("left out"), HasSubstr(part))))
        << place << " = " << value;
  }
}

TEST_F(HostileLevel, WithoutAnyPartIsRejectedOrRead) {
  const json flat = level_.flatten();
  for (const auto& [place, value] : flat.items()) {
    json document = level_;
    const json::json_pointer pointer(place);
    json& parent = document[pointer.parent_pointer()];
    if (parent.is_object()) parent.erase(pointer.back());
    const auto imported = import_level(write("level.gltf", document.dump()), {});
    if (!imported.ok()) {
      EXPECT_THAT(imported.error().message, HasSubstr("level.gltf")) << place;
    }
    for (const char* other : {"null", "true", "-1", "1e30", "\"\"", "[]", "{}", "[[]]"}) {
      document = level_;
      document[pointer] = json::parse(other);
      const auto changed = import_level(write("level.gltf", document.dump()), {});
      if (!changed.ok()) {
        EXPECT_THAT(changed.error().message, HasSubstr("level.gltf")) << place;
      }
    }
  }
}

TEST_F(HostileLevel, InBinaryTruncatedAtAnyByteIsRejected) {
  json document = level_;
  document["buffers"] = {{{"byteLength", bin_.size()}}};
  const std::string whole = glb(document, bin_);
  ASSERT_TRUE(import_level(write("level.glb", whole), {}).ok());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto imported = import_level(write("level.glb", whole.substr(0, size)), {});
    ASSERT_FALSE(imported.ok()) << size << " bytes";
    ASSERT_THAT(imported.error().message, HasSubstr("level.glb")) << size << " bytes";
  }
}

TEST_F(HostileLevel, InBinaryWithWrongLengthsIsRejected) {
  json document = level_;
  document["buffers"] = {{{"byteLength", bin_.size()}}};
  const std::string whole = glb(document, bin_);
  for (const std::size_t at : {4u, 8u, 12u})
    for (const std::uint32_t lie : {0u, 1u, 0x7fffffffu, 0xffffffffu}) {
      std::string broken = whole;
      std::memcpy(broken.data() + at, &lie, 4);
      EXPECT_FALSE(import_level(write("level.glb", broken), {}).ok()) << at << " " << lie;
    }
}

TEST_F(HostileLevel, WithNonFiniteVerticesIsRejectedWithTheNameOfTheMesh) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    bin_.replace(0, 4, raw(std::vector<float>{bad}));
    level_["buffers"][0]["uri"] = "data:;base64," + base64(bin_);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("'Shape'"), HasSubstr("not finite")));
  }
}

TEST_F(HostileLevel, ThatIsNoJsonOrTooDeepIsRejected) {
  const std::string deep(200000, '[');
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("null"),
        std::string("{\"asset\": 1e999}"), std::string("\xff\xfe"), std::string(1000, '\0'), deep,
        "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + deep + std::string(200000, ']') + "}"}) {
    const auto imported = import_level(write("level.gltf", text), {});
    ASSERT_FALSE(imported.ok());
    EXPECT_THAT(imported.error().message, HasSubstr("level.gltf"));
  }
}

TEST_F(HostileLevel, WithALongCycleOfNodesIsRejected) {
  constexpr int kNodes = testing::kSanitized ? 20'000 : 100'000;  // their frames are larger
  json nodes = json::array();
  for (int i = 0; i < kNodes; ++i) nodes.push_back({{"children", {(i + 1) % kNodes}}});
  level_["nodes"] = nodes;
  EXPECT_THAT(refusal(), HasSubstr("reached twice"));
}

TEST_F(HostileLevel, WithTooManyInstancedTrianglesIsRejectedBeforeTheyAreCreated) {
  // 2000 instances of 200 primitives of 1000 triangles: 400 million from 90 kB.
  const std::vector<std::uint8_t> zeros(3000, 0);
  level_ = {{"asset", {{"version", "2.0"}}}};
  bin_.clear();
  positions_ = floats({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int indices = accessor(view(raw(zeros)), 5121, 3000, "SCALAR");
  json primitives = json::array();
  for (int i = 0; i < 200; ++i)
    primitives.push_back({{"attributes", {{"POSITION", positions_}}}, {"indices", indices}});
  level_["meshes"] = {{{"primitives", primitives}}};
  const int places = floats(std::vector<float>(6000, 1.0f));
  node(
      {{"mesh", 0},
       {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}}}});
  EXPECT_THAT(refusal(), HasSubstr("200000000 triangles"));
}

TEST_F(HostileLevel, CannotLeaveItsFolderByALinkOrBlockOnAPipe) {
  const std::string outside = folder_ + "_secret.bin";
  std::ofstream(outside) << std::string(1000, 'x');
  std::filesystem::create_symlink(outside, folder_ + "/link.bin");
  level_["buffers"][0]["uri"] = "link.bin";
  EXPECT_THAT(refusal(), HasSubstr("leads out"));
  std::filesystem::remove(outside);
  ASSERT_EQ(::mkfifo((folder_ + "/pipe.bin").c_str(), 0600), 0);
  level_["buffers"][0]["uri"] = "pipe.bin";
  EXPECT_THAT(refusal(), HasSubstr("no regular file"));
}

TEST_F(HostileLevel, MayNameItsFilesWithEscapesAndInFolders) {
  std::filesystem::create_directory(folder_ + "/my sounds");
  std::filesystem::rename(folder_ + "/tone.wav", folder_ + "/my sounds/tone.wav");
  level_["extensions"]["KHR_audio_emitter"]["audio"][0]["uri"] = "my%20sounds/tone.wav";
  EXPECT_EQ(level().emitters.size(), 2u);
}

TEST_F(HostileLevel, WithoutContentsIsALevelWithAWarning) {
  level_ = {{"asset", {{"version", "2.0"}}}, {"buffers", json::array()}};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_EQ(imported->report.warnings.size(), 1u);  // for the missing emitter
}

TEST_F(HostileLevel, ThatIsMissingOrAFolderIsRejectedByName) {
  EXPECT_THAT(import_level(folder_ + "/none.gltf", {}).error().message, HasSubstr("none.gltf"));
  EXPECT_THAT(import_level(folder_, {}).error().message, HasSubstr("no regular file"));
}

TEST_F(HostileLevel, WithAnInvalidSidecarIsRejectedWithItsName) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "is empty"},
      {"[]", "object"},
      {"{\"material\": {}}", "'materials'"},
      {"{\"materials\": []}", "'materials'"},
      {"{\"materials\": {\"x\": \"bric\"}}", "'brick'"},
      {"{\"materials\": {\"x\": {}}}", "preset"},
      {"{\"emitters\": {}}", "list"},
      {"{\"emitters\": [{\"at\": [0, 0, 0]}]}", "signal"},
      {"{\"emitters\": [{\"signal\": \"noise\"}]}", "'at'"},
      {"{\"emitters\": [{\"signal\": \"noise\", \"at\": [0, 0]}]}", "three numbers"},
      {"{\"emitters\": [{\"signal\": \"noise\", \"at\": [0, 0, 0], \"gian\": 1}]}", "'gain'"},
      {"{\"emitters\": [{\"signal\": \"noise\", \"at\": [0, 0, 0], \"facing\": [0, 0, 0]}]}",
       "no direction"},
      {"{\"settings\": {\"air\": {\"temperature_c\": 900}}}", "temperature_c"},
      {"{\"settings\": {\"photons\": 0.5}}", "photons"},
      {"{\"settings\": {\"air\": {\"temperature\": 9}}}", "'temperature_c'"}};
  for (const auto& [text, part] : cases) {
    write("level.acoustics.json", text);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("level.acoustics.json"), HasSubstr(part))) << text;
  }
  write("level.acoustics.json", R"({"emitters": [{"signal": "../x.wav", "at": [0, 0, 0]}]})");
  EXPECT_THAT(refusal(), HasSubstr("leads out"));
  std::filesystem::remove(folder_ + "/level.acoustics.json");
  EXPECT_THAT(refusal({.sidecar = folder_ + "/none.json"}), HasSubstr("none.json"));
}

}  // namespace
}  // namespace clamor::testing
