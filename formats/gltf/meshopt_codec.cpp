#include "formats/gltf/meshopt_codec.h"

#include <fmt/format.h>

#ifdef CLAMOR_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace clamor {

#ifdef CLAMOR_HAS_MESHOPTIMIZER

namespace {

constexpr std::size_t kMaxStride = 256;
constexpr unsigned kVertexHeader = 0xa0;  // and the version of the codec

using Decode = int(void*, std::size_t, std::size_t, const unsigned char*, std::size_t);

bool is_newer_vertex_codec(std::span<const std::byte> stream) {
  const auto header = stream.empty() ? 0u : std::to_integer<unsigned>(stream[0]);
  return (header & 0xf0) == kVertexHeader && header > kVertexHeader;
}

// The library asserts what is checked here.
Result<void> check_shape(const MeshoptView& view, std::size_t stream_bytes) {
  const bool is_vertices = view.mode == "ATTRIBUTES", is_triangles = view.mode == "TRIANGLES";
  if (!is_vertices && !is_triangles && view.mode != "INDICES")
    return Error("has the mode " + in_quotes(view.mode) +
                 ", not ATTRIBUTES, TRIANGLES or INDICES; write the level again.");
  const std::size_t s = view.stride;
  if (is_vertices ? s == 0 || s % 4 != 0 || s > kMaxStride : s != 2 && s != 4)
    return Error(
        fmt::format("has elements of {} bytes, which its mode {} does not have; write the "
                    "level again.",
                    s, view.mode));
  if (is_triangles && view.count % 3 != 0)
    return Error(fmt::format(
        "has {} indices, which make no whole triangles; write the level again.", view.count));
  const bool fits =
      view.filter == "NONE" ||
      (is_vertices && ((view.filter == "OCTAHEDRAL" && (s == 4 || s == 8)) ||
                       (view.filter == "QUATERNION" && s == 8) || view.filter == "EXPONENTIAL"));
  if (!fits)
    return Error(
        fmt::format("has the filter '{}' on {} of {} bytes, which Clamor does not know; "
                    "write the level again without filters.",
                    view.filter, view.mode, s));
  if (view.count * s / kMaxUnpackedPerByte > stream_bytes)
    return Error(
        fmt::format("says that {} bytes unpack to {} elements of {}, more than they can; "
                    "it is damaged: write the level again.",
                    stream_bytes, view.count, s));
  return {};
}

}  // namespace

Result<FileBytes> decode_meshopt(const MeshoptView& view, std::span<const std::byte> stream) {
  if (const auto ok = check_shape(view, stream.size()); !ok.ok()) return ok.error();
  FileBytes unpacked(view.count * view.stride);
  if (unpacked.empty()) return unpacked;
  const auto* from = reinterpret_cast<const unsigned char*>(stream.data());
  const bool is_vertices = view.mode == "ATTRIBUTES";
  Decode* decode = meshopt_decodeIndexSequence;
  if (is_vertices) decode = meshopt_decodeVertexBuffer;
  if (view.mode == "TRIANGLES") decode = meshopt_decodeIndexBuffer;
  if (decode(unpacked.data(), view.count, view.stride, from, stream.size()) != 0)
    return is_vertices && is_newer_vertex_codec(stream)
               ? Error(fmt::format(
                     "is written by version {} of the vertex codec, which libmeshoptimizer {}.{} "
                     "of "
                     "this build does not read; write the level again by gltfpack with -ce ext, or "
                     "build Clamor with libmeshoptimizer 0.23 or newer.",
                     std::to_integer<unsigned>(stream[0]) & 0xf, MESHOPTIMIZER_VERSION / 1000,
                     MESHOPTIMIZER_VERSION / 10 % 100))
               : Error("is damaged: it does not unpack; copy or write the level again.");
  if (view.filter == "OCTAHEDRAL")
    meshopt_decodeFilterOct(unpacked.data(), view.count, view.stride);
  else if (view.filter == "QUATERNION")
    meshopt_decodeFilterQuat(unpacked.data(), view.count, view.stride);
  else if (view.filter == "EXPONENTIAL")
    meshopt_decodeFilterExp(unpacked.data(), view.count, view.stride);
  return unpacked;
}

#else

Result<FileBytes> decode_meshopt(const MeshoptView&, std::span<const std::byte>) {
  return Error(
      "is compressed, and this build of Clamor has no libmeshoptimizer, which unpacks it; build "
      "Clamor with it, or write the level again without compression.");
}

#endif

}  // namespace clamor
