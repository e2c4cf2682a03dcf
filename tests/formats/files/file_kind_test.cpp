// file_kind_test.cpp: what is said of files that are something else.
#include "formats/files/file_kind.h"

#include <gmock/gmock.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/sofa_file.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/walk_file.h"
#include "tests/build_paths.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using namespace std::string_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kPointer =
    "version https://git-lfs.github.com/spec/v1\noid sha256:" + std::string(64, '0') +
    "\nsize 12345\n";

class FileKinds : public LevelTest {};

TEST_F(FileKinds, OfForeignLevelsAreNamedWithTheStepThatHelps) {
  const struct {
    std::string text;
    const char* is;
    const char* step;
  } cases[] = {
      {kPointer, "a Git LFS pointer", "git lfs pull"},
      {"\n<!DOCTYPE html><html>404</html>", "a web page", "download the file itself"},
      {"<HTML><body>", "a web page", "download"},
      {"Kaydara FBX Binary  \0\x1a\0"s, "an FBX model", "Blender"},
      {"; FBX 7.4.0 project file", "an FBX model", "Blender"},
      {"# Blender 4\nmtllib a.mtl\nv 0 0 0\n", "an OBJ model", "Blender"},
      {"v 0 0 0\nf 1 2 3\n", "an OBJ model", "Blender"},
      {"BLENDER-v300", "a Blender file", "export glTF"},
      {"ISO-10303-21;\nFILE_SCHEMA(('IFC4'));", "an IFC model", "IfcConvert"},
      {"ISO-10303-21;\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));", "a STEP model", "FreeCAD"},
      {"#usda 1.0\n", "a USD model", "Blender"},
      {"PXR-USDC\0\0"s, "a USD model", "Blender"},
      {"PK\3\4" + std::string(26, '\0') + "level.usdc", "a USD model", "Blender"},
      {"PK\3\4" + std::string(26, '\0') + "level.glb", "a ZIP archive", "unpack"},
      {"solid cube\nfacet normal 0 0 1\n", "an STL model", "Blender"},
      {std::string(80, 'x') + "\1\0\0\0"s + std::string(50, '\0'), "an STL model", "Blender"},
      {"<?xml version=\"1.0\"?>\n<COLLADA>", "a COLLADA model", "Blender"},
      {"ply\nformat ascii 1.0", "a PLY model", "Blender"},
      {"CLAMOR\r\n" + std::string(90, '\0'), "a baked level already", "clamor play"},
      {wav(10), "a sound", "--emitter"},
      {"\xff\xfe{\0"s, "UTF-16 text", "UTF-8"}};
  for (const auto& [text, is, step] : cases)
    for (const char* name : {"level.glb", "level.gltf"}) {
      const auto imported = import_level(write(name, text), {});
      ASSERT_FALSE(imported.ok()) << is;
      EXPECT_THAT(imported.error().message,
                  AllOf(HasSubstr(std::string(name) + ": is " + is), HasSubstr(step)));
    }
}

TEST_F(FileKinds, AreToldByEveryReader) {
  const std::string path = write("pointer", kPointer);
  const auto of_pointer = AllOf(HasSubstr(path), HasSubstr("Git LFS pointer"));
  EXPECT_THAT(read_audio(path).error().message, of_pointer);
  EXPECT_THAT(read_sofa(path).error().message, of_pointer);
  EXPECT_THAT(Walk::read(path).error().message, of_pointer);
  EXPECT_THAT(BakeFile::open(path).error().message, HasSubstr("Git LFS pointer"));
  EXPECT_THAT(read_audio(write("page.wav", "<html>")).error().message, HasSubstr("web page"));
  EXPECT_THAT(read_audio(write("cut.wav", wav(10).substr(0, 20))).error().message,
              Not(HasSubstr("is a sound")));
  triangle();
  json document = finished();
  document["buffers"][0]["uri"] = "level.bin";
  document["buffers"][0]["byteLength"] = 4000;
  write("level.bin", kPointer);
  EXPECT_THAT(import_level(write("level.gltf", document.dump()), {}).error().message,
              HasSubstr("buffer 0 is a Git LFS pointer"));
}

TEST_F(FileKinds, OfSharedCasesAreNamed) {
  const std::pair<const char*, const char*> cases[] = {{"building.ifc", "IfcConvert"},
                                                       {"lfs_pointer.glb", "git lfs pull"},
                                                       {"model.fbx", "FBX"},
                                                       {"model.obj", "OBJ"},
                                                       {"page.glb", "web page"}};
  const std::string folder = shared_case("wrong_file_kind_messages/");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared cases here";
  for (const auto& [name, part] : cases)
    EXPECT_THAT(import_level(folder + name, {}).error().message, HasSubstr(part)) << name;
}

TEST_F(FileKinds, OfEmptyFilesIsEmptyWhateverIsWanted) {
  const std::string path = write("none", "");
  for (const std::string& why :
       {read_audio(path).error().message, BakeFile::open(path).error().message,
        Walk::read(path).error().message})
    EXPECT_THAT(why, HasSubstr("is empty"));
}

}  // namespace
}  // namespace clamor::testing
