#if __has_include(<meshoptimizer.h>)  // elsewhere the codec is built without its library, too

#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <meshoptimizer.h>

#include "tests/build_paths.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kVertices = 8, kIndices = 36;

std::vector<float> box_corners() {
  std::vector<float> corners;
  for (int i = 0; i < 8; ++i)
    for (const float coordinate : {i & 1 ? 5.0f : 0.0f, i & 2 ? 3.0f : 0.0f, i & 4 ? 4.0f : 0.0f})
      corners.push_back(coordinate);
  return corners;
}

std::vector<std::uint16_t> box_indices() {
  return {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
          2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
}

// The corners of all triangles, whatever the order of vertices and triangles.
std::vector<std::array<std::array<float, 3>, 3>> shape_of(const Mesh& mesh) {
  std::vector<std::array<std::array<float, 3>, 3>> shape;
  for (const auto& triangle : mesh.triangles) {
    std::array<std::array<float, 3>, 3> corners{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& at = mesh.vertices_m[triangle[c]];
      corners[c] = {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)};
    }
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    shape.push_back(corners);
  }
  std::ranges::sort(shape);
  return shape;
}

class CompressedLevel : public LevelTest {
 protected:
  // A box with normals, whose buffer views are 0: positions, 1: normals, 2: indices.
  void SetUp() override {
    LevelTest::SetUp();
    const int corners = floats(box_corners());
    const int normals = floats(std::vector<float>(3 * kVertices, 1));
    const int indices = accessor(view(raw(box_indices())), 5123, kIndices, "SCALAR");
    mesh({{"attributes", {{"POSITION", corners}, {"NORMAL", normals}}}, {"indices", indices}});
    node({{"mesh", 0}});
    plain_ = level().mesh;
    ASSERT_EQ(plain_.triangles.size(), 12u);
  }

  json& primitive() { return level_["meshes"][0]["primitives"][0]; }

  static json data_buffer(const std::string& bytes) {
    return {{"byteLength", bytes.size()},
            {"uri", "data:application/octet-stream;base64," + base64(bytes)}};
  }

  Mesh plain_;
};

// --- meshopt ------------------------------------------------------------------------------------

class MeshoptLevel : public CompressedLevel {
 protected:
  // Compresses all buffer views into buffer 1. Their buffer 0 is a fallback without data.
  void compress(const std::string& extension, const char* index_mode = "TRIANGLES") {
    meshopt_encodeVertexVersion(0);
    extension_ = extension;
    plain_bytes_ = bin_;
    std::string packed;
    for (std::size_t v = 0; v < 3; ++v) {
      std::string stream(4096, '\0');
      auto* to = reinterpret_cast<unsigned char*>(stream.data());
      const std::vector<std::uint16_t> indices = box_indices();
      stream.resize(v < 2 ? meshopt_encodeVertexBuffer(
                                to, stream.size(), bin_.data() + 12 * kVertices * v, kVertices, 12)
                    : std::string(index_mode) == "TRIANGLES"
                        ? meshopt_encodeIndexBuffer(to, stream.size(), indices.data(), kIndices)
                        : meshopt_encodeIndexSequence(to, stream.size(), indices.data(), kIndices));
      level_["bufferViews"][v]["extensions"][extension] = {
          {"buffer", 1},
          {"byteOffset", packed.size()},
          {"byteLength", stream.size()},
          {"byteStride", v < 2 ? 12 : 2},
          {"mode", v < 2 ? "ATTRIBUTES" : index_mode},
          {"count", v < 2 ? kVertices : kIndices}};
      packed += stream;
    }
    level_["buffers"] = {
        {{"byteLength", bin_.size()}, {"extensions", {{extension, {{"fallback", true}}}}}},
        data_buffer(packed)};
    level_["extensionsRequired"] = {extension};
  }
  json& packed_view(std::size_t v) { return level_["bufferViews"][v]["extensions"][extension_]; }
  // Makes the stream of a view one byte too short.
  void damage(std::size_t v) {
    json& length = packed_view(v)["byteLength"];
    length = length.get<int>() - 1;
  }

  std::string extension_, plain_bytes_;
};

TEST_F(MeshoptLevel, IsReadAsTheUncompressedOne) {
  for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    for (const char* mode : {"TRIANGLES", "INDICES"}) {
      compress(extension, mode);
      const Level read = level();
      EXPECT_EQ(shape_of(read.mesh), shape_of(plain_)) << extension << ' ' << mode;
      for (json& view : level_["bufferViews"]) view.erase("extensions");
    }
}

TEST_F(MeshoptLevel, IsReadFromItsFallback) {
  compress("EXT_meshopt_compression");
  for (const std::size_t v : {0u, 1u, 2u}) damage(v);
  write("fallback.bin", plain_bytes_);
  level_["buffers"][0]["uri"] = "fallback.bin";
  level_.erase("extensionsRequired");
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
}

TEST_F(MeshoptLevel, DoesWithoutAFallbackThatIsNotThere) {
  compress("EXT_meshopt_compression");
  level_["buffers"][0]["uri"] = "gone.bin";
  level_.erase("extensionsRequired");
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
}

TEST_F(MeshoptLevel, IsReadWhateverIsWrongWithNormals) {
  compress("EXT_meshopt_compression");
  damage(1);
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
  level_["bufferViews"][1].erase("extensions");
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
}

TEST_F(MeshoptLevel, IsRefusedWithTheViewThatIsDamaged) {
  compress("EXT_meshopt_compression");
  damage(2);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("level.gltf"), HasSubstr("bufferViews[2]"),
                               HasSubstr("EXT_meshopt_compression"), HasSubstr("damaged")));
}

TEST_F(MeshoptLevel, MayNotUnpackOneStreamInManyViews) {
  compress("EXT_meshopt_compression");
  const json view = level_["bufferViews"][0];
  for (int i = 0; i < 6000; ++i) level_["bufferViews"].push_back(view);
  EXPECT_THAT(refusal(), HasSubstr("more than its bytes can hold"));
}

TEST_F(MeshoptLevel, WithWrongNumbersIsRefusedWithASentence) {
  const struct {
    const char* key;
    const char* value;
    const char* part;
  } cases[] = {{"buffer", "2", "'buffer'"},
               {"buffer", "-1", "'buffer'"},
               {"buffer", "0.5", "whole number"},
               {"buffer", "0", "has only 0"},
               {"byteOffset", "100000", "has only"},
               {"byteOffset", "-4", "'byteOffset'"},
               {"byteLength", "1e14", "has only"},
               {"byteLength", "null", "'byteLength'"},
               {"byteStride", "16", "damaged"},
               {"byteStride", "0", "elements of 0 bytes"},
               {"count", "1e15", "more than its bytes can hold"},
               {"count", "4", "more than fit"},
               {"mode", "7", "'mode'"},
               {"mode", "\"POINTS\"", "mode 'POINTS'"},
               {"filter", "\"BLUR\"", "filter 'BLUR'"}};
  compress("EXT_meshopt_compression");
  const json valid = level_;
  for (const auto& [key, value, part] : cases) {
    level_ = valid;
    packed_view(0)[key] = json::parse(value);
    const std::string message = refusal();
    EXPECT_THAT(message, AllOf(HasSubstr("level.gltf"), HasSubstr(part))) << key << " = " << value;
    EXPECT_TRUE(message.ends_with('.')) << message;
  }
  level_ = valid;
  level_["bufferViews"][0]["byteStride"] = 16;
  EXPECT_THAT(refusal(), HasSubstr("stride of 16"));
}

// --- Draco --------------------------------------------------------------------------------------

// The box as Draco streams in hexadecimal digits, of both methods of encoding. Without quantisation
// its coordinates stay as they are.
constexpr const char kEdgebreakerBox[] =
    "445241434f02020101000000080c000b010003af3e0a01011001ff0000010009030000000000a04000004040"
    "000080400000a04000004040000000000000000000004040000080400000000000004040000000000000a040"
    "00000000000000000000a0400000000000008040000000000000000000008040000000000000000000000000";
constexpr const char kSequentialBox[] =
    "445241434f0202010000000c0801000102020103040506050706000204020504010603030607000401010406"
    "02030503070501010009030000000000000000000000000000000000000000004040000000000000a0400000"
    "0000000000000000a04000004040000000000000000000000000000080400000a04000000000000080400000"
    "000000004040000080400000a0400000404000008040";

// They hold the positions in 4 bits: in steps of a third of a metre, which suit the box.
constexpr const char kRoundedEdgebreakerBox[] =
    "445241434f02020101000000080c000b010003af3e0a01011001ff00000100090300000201010100050301"
    "1803011001180400445e85d10780c2010ec001000000000f0000000000000000000000000000000000a040"
    "04";
constexpr const char kRoundedSequentialBox[] =
    "445241434f0202010000000c08010002010102030405060507060001040105040206030306070004020204"
    "0601030503070501010009030000020001010005030128070118030048b1883444fc220d01000000000f00"
    "00000000000000000000000000000000a04004";

std::string bytes_of_digits(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
  return bytes;
}

class DracoLevel : public CompressedLevel {
 protected:
  void SetUp() override {
    CompressedLevel::SetUp();
    bin_.clear();
    level_["bufferViews"].clear();
    compress(bytes_of_digits(kEdgebreakerBox));
    if (const auto read = import(); !read.ok() && read.error().message.find("no Draco") < 1000)
      GTEST_SKIP() << "this build has no Draco library";
  }
  // Replaces all data of the level by a stream.
  void compress(const std::string& stream) {
    bin_ = stream;
    for (json& accessor : level_["accessors"]) accessor.erase("bufferView");
    level_["bufferViews"] = {{{"buffer", 0}, {"byteLength", stream.size()}}};
    primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0},
                                                               {"attributes", {{"POSITION", 0}}}};
    level_["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  }
  json& packed() { return primitive()["extensions"]["KHR_draco_mesh_compression"]; }
};

TEST_F(DracoLevel, IsReadAsTheUncompressedOne) {
  for (const char* stream : {kEdgebreakerBox, kSequentialBox}) {
    compress(bytes_of_digits(stream));
    EXPECT_EQ(shape_of(level().mesh), shape_of(plain_)) << stream;
  }
  // Its triangles are listed one by one, also where they were a strip.
  primitive()["mode"] = 5;
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
}

TEST_F(DracoLevel, TellsHowFarItsPositionsWereRounded) {
  EXPECT_EQ(import()->rounding_m, 0);
  level_["nodes"][0]["scale"] = {2, 2, 2};
  for (const char* stream : {kRoundedEdgebreakerBox, kRoundedSequentialBox}) {
    compress(bytes_of_digits(stream));
    const auto imported = import();
    ASSERT_TRUE(imported.ok()) << imported.error().message;
    EXPECT_NEAR(imported->rounding_m, 2 * std::sqrt(3) * 5 / 15, 1e-6);
    const auto shape = shape_of(imported->level.mesh), expected = shape_of(plain_);
    for (std::size_t t = 0; t < expected.size(); ++t)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_NEAR(shape[t][c][i], 2 * expected[t][c][i], 2e-6) << stream;
  }
  level_["accessors"][0]["componentType"] = 5122;
  EXPECT_THAT(refusal(), HasSubstr("differs from its accessor"));
}

TEST_F(DracoLevel, MayShareAStreamBetweenPrimitives) {
  level_["materials"] = {{{"name", "brick"}}, {{"name", "glass"}}};
  json second = primitive();
  primitive()["material"] = 0;
  second["material"] = 1;
  level_["meshes"][0]["primitives"].push_back(second);
  const Level read = level();
  EXPECT_EQ(read.mesh.triangles.size(), 24u);
  EXPECT_EQ(std::ranges::count(read.mesh.materials, 0), 12);
}

TEST_F(DracoLevel, IsReadFromItsFallback) {
  const std::string garbage(100, 'x');
  bin_ = garbage;
  level_["bufferViews"] = {{{"buffer", 0}, {"byteLength", garbage.size()}}};
  level_["accessors"][0]["bufferView"] = view(raw(box_corners()));
  level_["accessors"][2]["bufferView"] = view(raw(box_indices()));
  level_.erase("extensionsRequired");
  EXPECT_EQ(shape_of(level().mesh), shape_of(plain_));
}

TEST_F(DracoLevel, CutShortIsRefusedWithASentence) {
  const std::string whole = bin_;
  for (std::size_t size = 0; size < whole.size(); size += 5) {
    compress(whole.substr(0, size));
    EXPECT_THAT(refusal(), AllOf(HasSubstr("level.gltf: mesh 0"), HasSubstr("damaged"))) << size;
  }
}

TEST_F(DracoLevel, WithWrongNumbersIsRefusedWithASentence) {
  const struct {
    const char* place;
    const char* value;
    const char* part;
  } cases[] = {{"/bufferView", "1", "'bufferView'"},
               {"/bufferView", "null", "'bufferView'"},
               {"/attributes", "7", "'attributes'"},
               {"/attributes/POSITION", "1", "no attribute 1"},
               {"/attributes/POSITION", "-1", "'POSITION'"},
               {"/attributes/POSITION", "0.5", "whole number"}};
  const json valid = level_;
  for (const auto& [place, value, part] : cases) {
    level_ = valid;
    packed()[json::json_pointer(place)] = json::parse(value);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("KHR_draco_mesh_compression"), HasSubstr(part)))
        << place << " = " << value;
  }
  level_ = valid;
  level_["accessors"][0]["type"] = "VEC2";
  EXPECT_THAT(refusal(), HasSubstr("differs from its accessor"));
  level_["accessors"][0]["type"] = "MAT4";
  EXPECT_THAT(refusal(), HasSubstr("whose type Draco does not have"));
}

// --- Files that other tools wrote ---------------------------------------------------------------

TEST(CompressedCase, SoundsAsTheUncompressedLevel) {
  const std::string room = shared_level("../cases/draco_advice/room.glb");
  if (!std::filesystem::exists(room)) GTEST_SKIP() << room << " is not here";
  const auto plain = import_level(room, {});
  const auto packed = import_level(shared_level("../cases/draco_advice/room_draco.glb"), {});
  ASSERT_TRUE(plain.ok() && packed.ok()) << packed.error().message;
  EXPECT_EQ(packed->level.mesh.triangles.size(), plain->level.mesh.triangles.size());
  EXPECT_EQ(packed->level.emitters.size(), plain->level.emitters.size());
  ASSERT_EQ(packed->report.materials.size(), plain->report.materials.size());
  for (std::size_t m = 0; m < plain->report.materials.size(); ++m) {
    // Eleven bits of position err by 3 mm in 6 m.
    EXPECT_NEAR(packed->report.materials[m].area_m2 / plain->report.materials[m].area_m2, 1, 0.002);
    EXPECT_EQ(packed->level.materials[m].absorption, plain->level.materials[m].absorption);
  }
}

TEST(CompressedCase, OfANewerCodecIsReadOrRefusedWithAStepThatLosesNothing) {
  const std::string room = shared_level("../cases/meshopt_khr/room_khr.glb");
  if (!std::filesystem::exists(room)) GTEST_SKIP() << room << " is not here";
  const auto read = import_level(room, {});
  if (read.ok())
    EXPECT_EQ(read->level.mesh.triangles.size(), 12u);
  else
    EXPECT_THAT(read.error().message,
                AllOf(HasSubstr("room_khr.glb: bufferViews[0]"), HasSubstr("-ce ext")));
}

}  // namespace
}  // namespace clamor::testing

#endif
