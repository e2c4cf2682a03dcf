#include "formats/files/file_kind.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "common/text.h"

namespace clamor {

namespace {

using namespace std::string_view_literals;

constexpr std::size_t kHeadBytes = 4096;  // of the file that are looked at

struct Mark {
  std::string_view start;
  FileKind kind;
  std::string_view sentence;
};

constexpr std::string_view kByBlender =
    "; convert it to glTF first: import it in Blender and export glTF 2.0 (.glb) from there";
constexpr std::string_view kSound =
    "is a sound; let an emitter play it, as in --emitter \"signal=FILE,at=1,1.2,-3\"";

constexpr std::array kMarks = {
    Mark{"version https://git-lfs"sv, FileKind::kOther,
         "is a Git LFS pointer and not the file itself; run git lfs pull"},
    Mark{"Kaydara FBX Binary"sv, FileKind::kOther, "is an FBX model"},
    Mark{"; FBX"sv, FileKind::kOther, "is an FBX model"},
    Mark{
        "BLENDER"sv, FileKind::kOther,
        "is a Blender file; open it in Blender and export glTF 2.0 (.glb), with Clamor's add-on or "
        "without"},
    Mark{"#usda"sv, FileKind::kOther, "is a USD model"},
    Mark{"PXR-USDC"sv, FileKind::kOther, "is a USD model"},
    Mark{"solid"sv, FileKind::kOther, "is an STL model"},
    Mark{"ply\n"sv, FileKind::kOther, "is a PLY model"},
    Mark{"ply\r"sv, FileKind::kOther, "is a PLY model"},
    Mark{"#VRML"sv, FileKind::kOther, "is a VRML model"},
    Mark{"glTF"sv, FileKind::kLevel, "is a level; bake it first: clamor bake LEVEL -o FILE.clamor"},
    Mark{"CLAMOR\r\n"sv, FileKind::kBake,
         "is a baked level already; play it with clamor play, or bake the glTF level that it was "
         "made "
         "from (clamor inspect prints the command)"},
    Mark{"RIFF"sv, FileKind::kSound, kSound},
    Mark{"fLaC"sv, FileKind::kSound, kSound},
    Mark{"OggS"sv, FileKind::kSound, kSound},
    Mark{"ID3"sv, FileKind::kSound, kSound},
    Mark{"\x89HDF\r\n"sv, FileKind::kHead, "is an HDF5 file; give a head with --hrtf"},
    Mark{"b3dm"sv, FileKind::kOther,
         "is a 3D tile of Cesium, which has a glTF level inside; extract it with 3d-tiles-tools"},
    Mark{"\x1f\x8b"sv, FileKind::kOther, "is a gzip archive; unpack it with gunzip"},
    Mark{"\x28\xb5\x2f\xfd"sv, FileKind::kOther,
         "is compressed with zstd; if Blender wrote it, open it there and export glTF 2.0 (.glb)"},
    Mark{"7z\xbc\xaf"sv, FileKind::kOther, "is a 7z archive; unpack it and name the file in it"},
    Mark{"Rar!"sv, FileKind::kOther, "is a RAR archive; unpack it and name the file in it"},
    Mark{"\xff\xd8\xff"sv, FileKind::kOther, "is a picture (JPEG)"},
    Mark{"\x89PNG"sv, FileKind::kOther, "is a picture (PNG)"},
    Mark{"%PDF"sv, FileKind::kOther, "is a PDF document"},
    Mark{"\xff\xfe"sv, FileKind::kOther, "is UTF-16 text; save it as UTF-8"},
    Mark{"\xfe\xff"sv, FileKind::kOther, "is UTF-16 text; save it as UTF-8"}};

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

bool starts(std::string_view text, std::string_view word) {
  return equal_ignoring_case(text.substr(0, word.size()), word);
}

bool has_word(std::string_view text, std::string_view word) {
  for (; !text.empty(); text.remove_prefix(1))
    if (starts(text, word)) return true;
  return false;
}

// Text formats, by their first line that is neither empty nor a comment.
std::string text_kind(std::string_view head) {
  while (!head.empty()) {
    std::string_view line = head.substr(0, head.find('\n'));
    head.remove_prefix(std::min(head.size(), line.size() + 1));
    const std::size_t first = line.find_first_not_of(" \t\r\xef\xbb\xbf");
    if (first == std::string_view::npos || line[first] == '#') continue;
    line.remove_prefix(first);
    if (starts(line, "<!doctype html") || starts(line, "<html"))
      return "is a web page (HTML), which a failed download leaves; download the file itself";
    if (starts(line, "<?xml") || starts(line, "<collada"))
      return has_word(head, "<collada") || has_word(line, "<collada")
                 ? "is a COLLADA model" + std::string(kByBlender)
                 : "is an XML file and no glTF";
    if (starts(line, "iso-10303-21"))
      return contains(head, "IFC") || !contains(head, "FILE_SCHEMA")
                 ? "is an IFC model; convert it to glTF first: IfcConvert FILE.ifc FILE.glb, or "
                   "import it in Blender with Bonsai"
                 : "is a STEP model; convert it to glTF first, as with FreeCAD";
    for (const std::string_view word :
         {"v ", "vn ", "vt ", "f ", "o ", "g ", "s ", "mtllib ", "usemtl "})
      if (starts(line, word)) return "is an OBJ model" + std::string(kByBlender);
    return "";
  }
  return "";
}

// An STL file has 80 bytes of any kind, the number of triangles and 50 bytes for each.
bool is_binary_stl(std::span<const std::byte> file) {
  if (file.size() < 84 + 50) return false;
  std::uint32_t triangles;
  std::memcpy(&triangles, file.data() + 80, sizeof triangles);
  return file.size() == 84 + std::uint64_t{50} * triangles;
}

// The first file of a USD archive is a USD layer.
std::string zip_kind(std::string_view head) {
  if (contains(head.substr(0, std::min<std::size_t>(head.size(), 300)), ".usd"))
    return "is a USD model" + std::string(kByBlender);
  return "is a ZIP archive; unpack it and name the file in it";
}

}  // namespace

std::string other_kind(std::span<const std::byte> file, FileKind wanted) {
  if (file.empty()) return "is empty; copy or export it again";
  const std::string_view head(reinterpret_cast<const char*>(file.data()),
                              std::min(file.size(), kHeadBytes));
  if (head.starts_with("PK\3\4")) return zip_kind(head);
  for (const Mark& mark : kMarks)
    if (head.starts_with(mark.start)) {
      if (mark.kind == wanted) return "";
      std::string sentence(mark.sentence);
      if (sentence.ends_with(" model")) sentence += kByBlender;
      return sentence;
    }
  if (is_binary_stl(file)) return "is an STL model" + std::string(kByBlender);
  return text_kind(head);
}

}  // namespace clamor
