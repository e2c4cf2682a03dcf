// include_test.cpp: checks every #include against the layers of the design.
//
// The libraries are layered common <- formats <- {bake, runtime} <- tools, and so are the folders
// within each (kFolders). A third-party library may be included by a few files only; one that is
// not in the table may not be included at all.

#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <fnmatch.h>
#include <gtest/gtest.h>

#include "tests/project/source_tree.h"

namespace clamor::testing {
namespace {

const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"common", {"common"}},
    {"formats", {"common", "formats"}},
    {"bake", {"common", "formats", "bake"}},
    {"runtime", {"common", "formats", "runtime"}},
    {"tools", {"common", "formats", "bake", "runtime", "tools"}},
    {"tests", {"common", "formats", "bake", "runtime", "tools", "tests"}},
};

// The headers of a third-party library and the files that may include them, as shell patterns.
struct Fence {
  std::string library;
  std::vector<std::string> headers;
  std::vector<std::string> files;
};
const std::vector<Fence> kFences = {
    {"Cap'n Proto",
     {"capnp/*", "kj/*", "*.capnp.h"},
     {"formats/bake_file/bake_root_*", "tests/formats/forged_root.h"}},
    {"CLI11", {"CLI/*"}, {"tools/program/arguments.cpp"}},
    {"Draco", {"draco/*"}, {"formats/gltf/draco_codec.cpp"}},
    {"Embree", {"embree3/*", "embree4/*"}, {"formats/level/embree_scene.h", "tests/benchmarks/*"}},
    {"The Embree mesh",
     {"formats/level/embree_mesh.h", "formats/level/embree_scene.h",
      "formats/level/embree_instances.h"},
     {"formats/level/embree_*", "bake/trace/scene.cpp", "runtime/occlusion/occlusion_geometry.cpp",
      "runtime/occlusion/level_surfaces.cpp", "runtime/occlusion/packet_rays.h",
      "runtime/occlusion/part_*.cpp", "tests/benchmarks/bare_embree.h"}},
    {"fmt", {"fmt/*"}, {"formats/*.cpp", "bake/*.cpp", "tools/*/*.cpp"}},
    {"GLM",
     {"glm/*"},
     {"common/vec.h", "formats/gltf/gltf_*", "tools/view/window/scene_renderer.cpp"}},
    {"Dear ImGui", {"imgui.h", "imgui_internal.h", "backends/imgui_*"}, {"tools/view/window/*"}},
    {"GLFW",
     {"GLFW/*"},
     {"tools/view/window/keyboard.cpp", "tools/view/window/script_input.cpp",
      "tools/view/window/view_window.cpp"}},
    {"Google Benchmark", {"benchmark/*"}, {"tests/benchmarks/*"}},
    {"GoogleTest", {"gtest/*", "gmock/*"}, {"tests/*"}},
    {"Highway",
     {"hwy/*"},
     {"bake/trace/trace_*", "bake/octree/neighbour_kernel.cpp", "formats/bake_file/page_kernel.cpp",
      "formats/bake_file/page_columns-inl.h", "formats/bake_file/page_output-inl.h",
      "runtime/voices/gain_ramp_kernel.cpp", "runtime/voices/biquad_cascade.cpp",
      "runtime/voices/lane_fourier.cpp", "runtime/voices/mix_*", "runtime/field/field_kernel.cpp",
      "runtime/query/shortlist_kernel.cpp", "runtime/probes/first_reflection_kernel.cpp",
      "runtime/propagation/source_bound_lanes-inl.h", "runtime/propagation/source_page_kernel.cpp",
      "runtime/mixing/voice_kernel.cpp", "common/maths_lanes-inl.h",
      "runtime/propagation/intensity_kernel.cpp", "common/reflection_law-inl.h",
      "tools/bench/machine_peak.cpp"}},
    {"JACK", {"jack/*"}, {"runtime/output/jack_output.cpp", "tests/player/jack_listener.h"}},
    {"libebur128",
     {"ebur128.h"},
     {"runtime/output/loudness_meter.cpp", "tools/analysis/programme_loudness.cpp", "tests/*"}},
    {"libmysofa", {"mysofa.h"}, {"formats/audio/sofa_tables.cpp"}},
    {"libsamplerate", {"samplerate.h"}, {"runtime/mixing/resampler.cpp"}},
    {"libFLAC", {"FLAC/*"}, {"formats/audio/flac_codec.cpp"}},
    {"libsndfile", {"sndfile.h"}, {"formats/audio/sndfile_stream.cpp", "tests/*"}},
    {"libsoxr", {"soxr.h"}, {"formats/audio/audio_file.cpp"}},
    {"meshoptimizer",
     {"meshoptimizer.h"},
     {"formats/gltf/meshopt_codec.cpp", "tests/formats/gltf/*_test.cpp"}},
    {"nanoflann", {"nanoflann.hpp"}, {"runtime/probes/probe_neighbours.cpp"}},
    {"nlohmann-json",
     {"nlohmann/*"},
     {"formats/files/json.cpp", "tools/analysis/json_values.h", "tools/*_command.cpp", "tests/*"}},
    {"The installed library",
     {"clamor.h", "clamor.hpp", "clamor_bake.h"},
     {"runtime/bindings/godot/*", "runtime/examples/*", "runtime/clamor.hpp", "bake/examples/*"}},
    {"OpenAL Soft", {"AL/*"}, {"tools/bench/openal_voices.cpp"}},
    {"OpenGL", {"GL/*"}, {"tools/view/window/sc*.cpp"}},
    {"stb", {"stb/*"}, {"tools/view/window/screenshot.cpp"}},
    {"OpenMesh", {"OpenMesh/*"}, {"bake/mesh/collapsible_surface.h", "tests/bake/mesh/mesh_*"}},
    {"POSIX",
     {"csignal", "dirent.h", "dlfcn.h", "fcntl.h", "link.h", "poll.h", "pthread.h", "pwd.h",
      "sched.h", "semaphore.h", "signal.h", "spawn.h", "sys/*", "termios.h", "ucontext.h",
      "unistd.h"},
     {"common/platform/posix/*", "common/platform/windows/*", "runtime/examples/*", "tests/*",
      "runtime/bindings/godot/baker.cpp"}},  // which is linked with libclamor alone
    {"Windows", {"io.h", "psapi.h", "shellapi.h", "windows.h"}, {"common/platform/windows/*"}},
    {"PulseAudio", {"pulse/*"}, {"runtime/output/pulse_output.cpp"}},
    {"RtAudio", {"RtAudio.h", "rtaudio/*"}, {"runtime/output/audio_device.cpp"}},
    {"TBB", {"tbb/*", "oneapi/*"}, {"formats/level/embree_scene.cpp", "tests/one_tbb_thread.cpp"}},
    {"tinygltf", {"tiny_gltf.h"}, {"formats/gltf/texture_colour.cpp"}},
    {"Valgrind", {"valgrind/*"}, {"tests/price/*"}},
    {"xxHash",
     {"xxhash.h"},
     {"formats/bake_file/bake_layout.cpp", "formats/files/level_folder.cpp"}},
    {"zstd", {"zstd.h"}, {"formats/bake_file/bake_layout.cpp"}},
};

// Headers of the C library, POSIX and the compiler. C++ headers have no dot in their names.
bool is_system_header(const std::string& header) {
  static const std::set<std::string> kHeaders = {
      "dirent.h",  "dlfcn.h",  "fcntl.h",  "fnmatch.h", "immintrin.h", "poll.h",      "pty.h",
      "pthread.h", "pwd.h",    "sched.h",  "signal.h",  "termios.h",   "time.h",      "ucontext.h",
      "unistd.h",  "malloc.h", "errno.h",  "glob.h",    "emmintrin.h", "semaphore.h", "link.h",
      "spawn.h",   "stddef.h", "stdint.h", "stdlib.h",  "xmmintrin.h"};
  return header.find_first_of("./") == std::string::npos || header.starts_with("sys/") ||
         kHeaders.contains(header);
}

bool matches(const std::string& name, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  });
}

std::string folder_of(const std::string& path) { return path.substr(0, path.find('/')); }

// The level of a file's folder within its library; files outside of a folder are on top, but those
// of common/ and its only folder may include each other.
std::size_t level_of(const std::string& path) {
  const std::vector<std::string>& folders = kFolders.at(folder_of(path));
  const std::size_t begin = path.find('/') + 1, end = path.find('/', begin);
  if (end == std::string::npos) return folder_of(path) == "common" ? 0 : folders.size();
  const auto found = std::ranges::find(folders, path.substr(begin, end - begin));
  return static_cast<std::size_t>(found - folders.begin());
}

// The problem with `file` including `header`, or an empty string.
std::string complaint(const std::string& file, const std::string& header, bool quoted) {
  for (const Fence& fence : kFences)
    if (matches(header, fence.headers))
      return matches(file, fence.files) ? ""
                                        : fence.library +
                                              " ends behind its fence; call the module "
                                              "that hides it, or widen kFences and "
                                              "say why";
  if (!quoted)
    return is_system_header(header) ? "" : "a library without a fence; add it to kFences";
  if (header == "embedded_materials.h")
    return folder_of(file) == "formats" ? "" : "only formats reads the embedded presets";
  if (header == "embedded_page.h")
    return folder_of(file) == "tools" ? "" : "only tools writes pages";
  if (!std::filesystem::is_regular_file(kRoot / header))
    return "no such file from the repository's root, which is where our includes start";
  const auto allowed = kMayInclude.find(folder_of(file));
  if (allowed == kMayInclude.end() || !allowed->second.contains(folder_of(header)))
    return folder_of(file) + " may not know " + folder_of(header);
  if (folder_of(file) == folder_of(header) && kFolders.contains(folder_of(file)) &&
      level_of(header) > level_of(file))
    return "the folder of the header lies above that of the file, see kFolders";
  return "";
}

struct Include {
  std::string header;
  bool quoted = false;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> includes;
  for (const std::string& line : lines_of(text))
    if (std::smatch match; std::regex_search(line, match, kInclude))
      includes.push_back({match[2], match[1] == "\""});
  return includes;
}

std::vector<std::string> complaints(const std::string& file, const std::string& text) {
  std::vector<std::string> all;
  for (const auto& [header, quoted] : includes_of(text))
    if (const std::string what = complaint(file, header, quoted); !what.empty())
      all.push_back(file + " includes " + header + ": " + what);
  return all;
}

TEST(Includes, FollowTheDirectionOfTheDesignAndStopAtTheFences) {
  std::size_t count = 0;
  for (const auto& [folder, allowed] : kMayInclude)
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file)) continue;
      const std::string text = read_text(kRoot / file);
      count += includes_of(text).size();
      for (const std::string& what : complaints(file, text)) ADD_FAILURE() << what;
    }
  EXPECT_GT(count, 500u) << "where have all the includes gone?";
}

TEST(Includes, OfAFenceAreMetSomewhereSoThatNoFenceStandsRoundNothing) {
  std::set<std::string> met;
  for (const auto& [folder, allowed] : kMayInclude)
    for (const std::string& file : files_in(folder))
      if (is_code(file))
        for (const auto& include : includes_of(read_text(kRoot / file)))
          for (const Fence& fence : kFences)
            if (matches(include.header, fence.headers)) met.insert(fence.library);
  for (const Fence& fence : kFences) EXPECT_TRUE(met.contains(fence.library)) << fence.library;
}

TEST(Includes, ThatBreakTheDesignAreCaught) {
  const auto caught = [](const std::string& file, const std::string& line) {
    return complaints(file, line + "\n").size() == 1;
  };
  EXPECT_TRUE(caught("common/air.cpp", "#include \"formats/level/level.h\""));
  EXPECT_TRUE(caught("formats/bake_file/page.cpp", "#include \"bake/bake.h\""));
  EXPECT_TRUE(caught("formats/bake_file/page.cpp", "#include \"runtime/engine/auralizer.h\""));
  EXPECT_TRUE(caught("formats/files/json.cpp", "#include \"formats/level/level.h\""));
  EXPECT_TRUE(caught("bake/trace/scene.cpp", "#include \"runtime/engine/auralizer.h\""));
  EXPECT_TRUE(
      caught("runtime/mixing/mixer.cpp", "#  include \"bake/trace/scene.h\"  // just this once"));
  EXPECT_TRUE(caught("runtime/mixing/mixer.cpp", "#include \"tools/commands/commands.h\""));
  EXPECT_TRUE(caught("tools/main.cpp", "#include \"tests/rooms.h\""));
  EXPECT_TRUE(caught("bake/trace/scene.cpp", "#include \"bake/bake.h\""));
  EXPECT_TRUE(caught("bake/bake.cpp", "#include <embree3/rtcore.h>"));
  EXPECT_TRUE(caught("bake/trace/scene.h", "#include <embree4/rtcore.h>"));
  EXPECT_TRUE(caught("formats/gltf/gltf_document.cpp", "#include <tiny_gltf.h>"));
  EXPECT_TRUE(
      caught("runtime/mixing/mixer.cpp", "#include \"formats/bake_file/bake_root.capnp.h\""));
  EXPECT_TRUE(caught("runtime/mixing/mixer.cpp", "#include <fmt/format.h>"));
  EXPECT_TRUE(caught("tools/main.cpp", "#include <gtest/gtest.h>"));
  EXPECT_TRUE(caught("common/air.cpp", "#include <boost/any.hpp>"));
  EXPECT_TRUE(caught("common/air.cpp", "#include \"air.h\""));
  EXPECT_TRUE(caught("common/air.cpp", "#include <unistd.h>"));
  EXPECT_TRUE(caught("common/platform/thread.h", "#include <sys/types.h>"));
  EXPECT_TRUE(caught("assets/generate/main.cpp", "#include \"common/air.h\""));

  EXPECT_TRUE(caught("runtime/query/octree_pool.cpp", "#include \"runtime/engine/auralizer.h\""));
  EXPECT_TRUE(caught("runtime/sampling/sampler.h", "#include \"runtime/mixing/mixer.h\""));
  EXPECT_TRUE(caught("bake/trace/photon_tracer.cpp", "#include \"bake/bake.h\""));
  EXPECT_TRUE(caught("tools/strategies/strategies.cpp", "#include \"tools/analysis/measures.h\""));

  EXPECT_FALSE(caught("runtime/mixing/mixer.h", "#include \"runtime/sampling/sampler.h\""));
  EXPECT_FALSE(caught("tools/commands/bake_command.cpp", "#include \"bake/bake.h\""));
  EXPECT_FALSE(caught("formats/level/embree_scene.h", "#include <embree3/rtcore.h>"));
  EXPECT_FALSE(caught("bake/trace/scene.cpp", "#include \"formats/level/embree_mesh.h\""));
  EXPECT_TRUE(caught("bake/trace/scene.cpp", "#include \"bake/bake.h\""));
  EXPECT_TRUE(caught("bake/bake.cpp", "#include \"formats/level/embree_mesh.h\""));
  EXPECT_FALSE(caught("common/air.cpp", "// #include \"formats/level/level.h\" would be wrong"));
}

// fmt 11 no longer has it in format.h.
TEST(Includes, HaveTheHeaderOfJoinWhereItIsUsed) {
  for (const std::string folder : {"common", "formats", "bake", "runtime", "tools"})
    for (const std::string& file : files_in(folder)) {
      if (!is_code(file)) continue;
      const std::string text = read_text(kRoot / file);
      if (text.find("fmt::join") != std::string::npos) {
        EXPECT_NE(text.find("#include <fmt/ranges.h>"), std::string::npos) << file;
      }
    }
}

}  // namespace
}  // namespace clamor::testing
