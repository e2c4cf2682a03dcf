#if __has_include(<meshoptimizer.h>)  // elsewhere the codec is built without its library, too

#include "formats/gltf/meshopt_codec.h"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <meshoptimizer.h>

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

template <class T>
FileBytes packed_vertices(const std::vector<T>& values, std::size_t stride) {
  const std::size_t count = values.size() * sizeof(T) / stride;
  FileBytes packed(meshopt_encodeVertexBufferBound(count, stride));
  packed.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                           packed.size(), values.data(), count, stride));
  return packed;
}

template <class T>
std::vector<T> values_of(const FileBytes& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<float> waves(std::size_t count) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = std::sin(0.1f * static_cast<float>(i));
  return values;
}

TEST(MeshoptCodec, ReturnsTheVerticesThatWereCompressed) {
  meshopt_encodeVertexVersion(0);
  const std::vector<float> vertices = waves(3000);
  const auto unpacked =
      decode_meshopt({"ATTRIBUTES", "NONE", 1000, 12}, packed_vertices(vertices, 12));
  ASSERT_TRUE(unpacked.ok()) << unpacked.error().message;
  EXPECT_EQ(values_of<float>(*unpacked), vertices);
}

// The filter stores 8 bits of exponent above 24 bits of mantissa.
TEST(MeshoptCodec, AppliesTheExponentialFilter) {
  meshopt_encodeVertexVersion(0);
  const std::vector<std::uint32_t> stored = {0xFC000018, 0x01FFFFFD, 0, 0x00000007};
  const auto unpacked =
      decode_meshopt({"ATTRIBUTES", "EXPONENTIAL", 4, 4}, packed_vertices(stored, 4));
  ASSERT_TRUE(unpacked.ok()) << unpacked.error().message;
  EXPECT_EQ(values_of<float>(*unpacked), (std::vector<float>{24.0f / 16, -3.0f * 2, 0, 7}));
}

TEST(MeshoptCodec, AppliesTheFiltersOfDirectionsAndRotations) {
  meshopt_encodeVertexVersion(0);
  const auto axis = decode_meshopt({"ATTRIBUTES", "OCTAHEDRAL", 1, 4},
                                   packed_vertices(std::vector<std::int8_t>{0, 0, 127, 0}, 4));
  ASSERT_TRUE(axis.ok()) << axis.error().message;
  EXPECT_EQ(values_of<std::int8_t>(*axis), (std::vector<std::int8_t>{0, 0, 127, 0}));

  const float turn[4] = {0, std::sqrt(0.5f), 0, std::sqrt(0.5f)};
  std::vector<std::int16_t> stored(4);
  meshopt_encodeFilterQuat(stored.data(), 1, 8, 16, turn);
  const auto rotation =
      decode_meshopt({"ATTRIBUTES", "QUATERNION", 1, 8}, packed_vertices(stored, 8));
  ASSERT_TRUE(rotation.ok()) << rotation.error().message;
  const auto q = values_of<std::int16_t>(*rotation);
  EXPECT_NEAR(std::abs(q[1]), 32767 * std::sqrt(0.5), 1);
  EXPECT_EQ(q[0], 0);
  EXPECT_EQ(q[1], q[3]);
}

TEST(MeshoptCodec, RefusesAStreamCutShortAtAnyByte) {
  meshopt_encodeVertexVersion(0);
  const FileBytes whole = packed_vertices(waves(300), 12);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(decode_meshopt({"ATTRIBUTES", "NONE", 100, 12}, std::span(whole).first(size)).ok())
        << size << " bytes";
}

TEST(MeshoptCodec, SaysWhatIsWrong) {
  meshopt_encodeVertexVersion(0);
  const FileBytes packed = packed_vertices(waves(12), 12);
  const struct {
    MeshoptView view;
    const char* part;
  } cases[] = {{{"MESHLETS", "NONE", 4, 12}, "mode 'MESHLETS'"},
               {{"ATTRIBUTES", "NONE", 4, 0}, "elements of 0 bytes"},
               {{"ATTRIBUTES", "NONE", 4, 10}, "elements of 10 bytes"},
               {{"ATTRIBUTES", "NONE", 4, 260}, "elements of 260 bytes"},
               {{"TRIANGLES", "NONE", 3, 12}, "elements of 12 bytes"},
               {{"INDICES", "NONE", 3, 1}, "elements of 1 bytes"},
               {{"TRIANGLES", "NONE", 4, 2}, "no whole triangles"},
               {{"ATTRIBUTES", "OCTAHEDRAL", 4, 12}, "filter 'OCTAHEDRAL'"},
               {{"ATTRIBUTES", "QUATERNION", 4, 4}, "filter 'QUATERNION'"},
               {{"ATTRIBUTES", "COLOR", 4, 4}, "filter 'COLOR'"},
               {{"TRIANGLES", "EXPONENTIAL", 3, 4}, "filter 'EXPONENTIAL'"},
               {{"ATTRIBUTES", "NONE", 1'000'000'000'000'000, 256}, "more than they can"},
               {{"ATTRIBUTES", "NONE", 100'000, 12}, "more than they can"},
               {{"ATTRIBUTES", "NONE", 400, 12}, "damaged"},
               {{"TRIANGLES", "NONE", 12, 4}, "damaged"},
               {{"INDICES", "NONE", 12, 4}, "damaged"}};
  for (const auto& [view, part] : cases) {
    const auto unpacked = decode_meshopt(view, packed);
    ASSERT_FALSE(unpacked.ok()) << part;
    EXPECT_THAT(unpacked.error().message, HasSubstr(part));
    EXPECT_TRUE(unpacked.error().message.ends_with('.')) << unpacked.error().message;
  }
}

TEST(MeshoptCodec, SaysHowToWriteAgainWhatANewerCodecWrote) {
  if (MESHOPTIMIZER_VERSION >= 230) GTEST_SKIP() << "this library reads the newer codec";
  meshopt_encodeVertexVersion(0);
  FileBytes packed = packed_vertices(waves(12), 12);
  packed[0] = std::byte{0xa1};
  EXPECT_THAT(decode_meshopt({"ATTRIBUTES", "NONE", 4, 12}, packed).error().message,
              HasSubstr("-ce ext"));
}

}  // namespace
}  // namespace clamor::testing

#endif
