// Tests that files damaged by accident (which checksums detect) or on purpose (which they do not)
// are refused or harmless: no crash, no hang, no excessive memory.
#include <cmath>
#include <cstring>
#include <memory>
#include <random>

#include <fcntl.h>
#include <unistd.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "tests/baked_room.h"
#include "tests/checksums.h"
#include "tests/faults/allocations.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

constexpr std::size_t kMuchMemory = 4 << 20;
constexpr int kFlips = kSanitized ? 800 : 4'000;

// A bake with several pages and tiny signals.
BakeContents small_contents() {
  BakeContents contents = baked_contents(300);
  for (Signal& signal : contents.signals) signal.samples.resize(200, 0.25f);
  return contents;
}

// A file whose bits can be flipped in place, fast enough for a hundred thousand flips.
class Damaged {
 public:
  Damaged() {
    EXPECT_TRUE(write_bake(path(), small_contents(), 1).ok());
    descriptor_ = ::open(path().c_str(), O_RDWR | O_CLOEXEC);
    const std::string bytes = read(path());
    whole_.assign(bytes.begin(), bytes.end());
    Preamble preamble;
    std::memcpy(&preamble, whole_.data(), sizeof preamble);
    root_ = preamble.root_offset;
    const auto file = BakeFile::open(path());
    EXPECT_TRUE(file.ok());
    pages_end_ = sizeof(Preamble) + file->bytes().pages;
    page_count_ = file->page_count();
  }
  ~Damaged() { ::close(descriptor_); }

  std::string path() const { return folder_ / "damaged.clamor"; }
  std::size_t size() const { return whole_.size(); }
  std::size_t pages_end() const { return pages_end_; }
  std::size_t root() const { return root_; }
  std::uint64_t page_count() const { return page_count_; }

  void flip(std::size_t bit) {
    put(bit / 8, std::string(1, static_cast<char>(whole_[bit / 8] ^ (1 << bit % 8))));
  }
  void put(std::size_t offset, const std::string& bytes) {
    ASSERT_EQ(::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset)),
              static_cast<ssize_t>(bytes.size()));
  }
  void mend(std::size_t offset, std::size_t bytes = 1) {
    put(offset, std::string(whole_.data() + offset, bytes));
  }

 private:
  Folder folder_;
  int descriptor_ = -1;
  std::vector<char> whole_;
  std::size_t root_ = 0, pages_end_ = 0;
  std::uint64_t page_count_ = 0;
};

// Checks that a source of a forged file holds only values that its readers can handle.
void expect_sound(const Source& source, const BakeFile& file) {
  double sum = source.delay_s + source.patch_radius_m;
  for (const float power : source.power) {
    sum += power;
    ASSERT_GE(power, 0);
  }
  for (int axis = 0; axis < 3; ++axis)
    sum += source.position_m[axis] + source.normal[axis] + source.mirror[axis];
  ASSERT_TRUE(std::isfinite(sum));
  ASSERT_TRUE(source.u > 0 && source.u <= 1);
  ASSERT_LT(source.emitter, file.emitters().size());
  ASSERT_TRUE(source.is_emitter || source.material < file.materials().size());
}

// Reads all pages. Returns false if the file is refused, with a sentence that names it.
bool read_pages(const Damaged& damaged) {
  const auto refused = [&](const Error& error) {
    EXPECT_NE(error.message.find(damaged.path()), std::string::npos) << error.message;
    return false;
  };
  const auto file = BakeFile::open(damaged.path());
  if (!file.ok()) return refused(file.error());
  const auto done = file->for_each_page(
      [&](const PageEntry&, const OctreePage& page, std::size_t, std::size_t) -> Result<void> {
        for (const Source& source : page.sources) expect_sound(source, *file);
        return {};
      });
  return done.ok() || refused(done.error());
}

TEST(DamagedFile, WithAnyBitOfItsPagesFlippedIsRefused_NoAsan) {
  Damaged damaged;
  ASSERT_GT(damaged.page_count(), 3u);
  std::mt19937_64 random(1);
  watch_allocations();
  for (int i = 0; i < kFlips; ++i) {
    const std::size_t bit =
        8 * sizeof(Preamble) + random() % (8 * (damaged.pages_end() - sizeof(Preamble)));
    damaged.flip(bit);
    ASSERT_FALSE(read_pages(damaged)) << "bit " << bit;
    damaged.mend(bit / 8);
  }
  EXPECT_LT(allocations().largest, kMuchMemory);
  EXPECT_TRUE(read_pages(damaged));
}

TEST(ForgedFile, WithAnyBitOfItsPagesFlippedIsRefusedOrHarmless) {
  const ChecksumsOff off;
  Damaged damaged;
  std::mt19937_64 random(2);
  int refused = 0;
  watch_allocations();
  for (int i = 0; i < kFlips; ++i) {
    const std::size_t bit =
        8 * sizeof(Preamble) + random() % (8 * (damaged.pages_end() - sizeof(Preamble)));
    damaged.flip(bit);
    refused += !read_pages(damaged);
    ASSERT_FALSE(HasFatalFailure()) << "bit " << bit;
    damaged.mend(bit / 8);
  }
  EXPECT_LT(allocations().largest, kMuchMemory);
  // Most fields of a page may hold any number, so most flips only change the sound.
  EXPECT_GT(refused, kFlips / 20);
  EXPECT_LT(refused, kFlips * 19 / 20);
}

TEST(ForgedFile, WithAnyBitOfItsPreambleOrRootFlippedIsRefusedOrHarmless) {
  const ChecksumsOff off;
  Damaged damaged;
  watch_allocations();
  int refused = 0;
  const auto try_byte = [&](std::size_t byte) {
    for (std::size_t bit = 8 * byte; bit < 8 * byte + 8; ++bit) {
      if (kSanitized && byte >= sizeof(Preamble) && bit % 3 != 0) continue;  // slow
      damaged.flip(bit);
      const auto file = BakeFile::open(damaged.path());
      refused += !file.ok();
      if (file.ok() && bit % 16 == 0) {  // every sixteenth file is also read to the end
        read_pages(damaged);
        for (std::size_t s = 0; s < file->signal_count(); ++s) {
          (void)file->read_signal(s);
          (void)file->read_envelope(s);
        }
        (void)file->read_mesh();
      }
      ASSERT_FALSE(HasFatalFailure()) << "bit " << bit;
    }
    damaged.mend(byte);
  };
  for (std::size_t byte = 0; byte < sizeof(Preamble); ++byte) try_byte(byte);
  EXPECT_GT(refused, 150);  // all but the minor version and the checksums
  for (std::size_t byte = damaged.root(); byte < damaged.size(); ++byte) try_byte(byte);
  EXPECT_LT(allocations().largest, kMuchMemory);
}

TEST(ForgedFile, WithAnyBitOfItsGeometryFlippedIsRefusedOrHarmless) {
  const ChecksumsOff off;
  Damaged damaged;
  const auto whole = BakeFile::open(damaged.path());
  ASSERT_TRUE(whole.ok());
  ASSERT_EQ(whole->geometry_page_count(), 1u);
  const GeometryPageInfo page = whole->geometry_page(0);
  watch_allocations();
  int refused = 0;
  for (std::size_t bit = 8 * page.offset; bit < 8 * (page.offset + page.packed_bytes); ++bit) {
    damaged.flip(bit);
    const auto mesh = BakeFile::open(damaged.path())->read_mesh();
    refused += !mesh.ok();
    if (mesh.ok()) {
      ASSERT_EQ(mesh->triangles.size(), page.triangles) << "bit " << bit;
      for (const auto& triangle : mesh->triangles)
        for (const std::uint32_t corner : triangle) ASSERT_LT(corner, page.vertices);
    }
    damaged.mend(bit / 8);
  }
  EXPECT_LT(allocations().largest, kMuchMemory);
  EXPECT_GT(refused, 100);
  EXPECT_TRUE(BakeFile::open(damaged.path())->read_mesh().ok());
}

// A player turns forged files into finite samples, or reports a sentence.
TEST(ForgedFile, IsPlayedWithoutHarmWhereItIsNotRefused) {
  const ChecksumsOff off;
  Damaged damaged;
  std::mt19937_64 random(3);
  int played = 0;
  constexpr int kFiles = kSanitized ? 120 : 300;
  for (int i = 0; i < kFiles; ++i) {
    // Half of the flips hit pages, half the root.
    const std::size_t start = i % 2 == 0 ? sizeof(Preamble) : damaged.root();
    const std::size_t end = i % 2 == 0 ? damaged.pages_end() : damaged.size();
    const std::size_t bit = 8 * start + random() % (8 * (end - start));
    damaged.flip(bit);
    auto file = BakeFile::open(damaged.path());
    if (file.ok()) {
      AuralizerOptions options;
      options.voices = 50;
      options.wait_for_pages = true;
      const auto auralizer =
          Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
      if (auralizer.ok()) {
        ++played;
        std::vector<float> block(2 * 960);
        for (int k = 0; k < 3; ++k) {
          while ((*auralizer)->wants_keyframe())
            (*auralizer)->make_keyframe({{3 + 0.1 * k, 4, 1.5}, 0, 0});
          (*auralizer)->mix(block);
          for (const float sample : block) ASSERT_TRUE(std::isfinite(sample)) << "bit " << bit;
        }
      }
    }
    damaged.mend(bit / 8);
  }
  EXPECT_GT(played, kFiles / 3);
}

TEST(ForgedFile, WithAPageThatDeclaresFourGigabytesCostsNothing) {
  const ChecksumsOff off;
  Damaged damaged;
  // Zstd frame headers that declare 4 GB and 2^63 bytes.
  const std::string zstd = "\x28\xb5\x2f\xfd\xe0";
  for (const std::string& size :
       {std::string("\0\0\0\0\1\0\0\0", 8), std::string("\0\0\0\0\0\0\0\x80", 8)}) {
    std::vector<std::uint64_t> offsets;
    ASSERT_TRUE(BakeFile::open(damaged.path())
                    ->for_each_page([&](const PageEntry& entry, const OctreePage&, std::size_t,
                                        std::size_t) -> Result<void> {
                      offsets.push_back(entry.page.offset);
                      return {};
                    })
                    .ok());
    for (const std::uint64_t offset : offsets) {
      damaged.put(offset, zstd + size);
      watch_allocations();
      EXPECT_FALSE(read_pages(damaged));
      EXPECT_LT(allocations().all, 1u << 20);
      damaged.mend(offset, 13);
    }
  }
  if (!kSanitized) {
    watch_allocations();
    EXPECT_TRUE(read_pages(damaged));
    EXPECT_GT(allocations().all, 0u);  // the counter works
  }
}

// A mapped page is decoded in place after its checksum was verified.
TEST(MappedPage, ThatIsOverwrittenBetweenItsChecksumAndItsDecodingIsAnError) {
  Damaged damaged;
  const auto file = BakeFile::open(damaged.path(), FileAccess::kMap);
  ASSERT_TRUE(file.ok() && file->is_mapped());
  const PageEntry& top = *file->top();
  std::size_t decodes = 0;
  for (std::uint64_t at = top.page.offset; at < top.page.end(); ++at) {
    after_checksum = [&] { damaged.flip(8 * at); };
    const auto page = file->read_page(top);
    EXPECT_FALSE(page.ok()) << at;
    if (!page.ok()) {
      EXPECT_NE(page.error().message.find("fails its checksum"), std::string::npos);
    }
    {
      const ChecksumsOff off;
      PageEntry forged = top;
      forged.page.hash = 0x1234567;
      decodes += file->read_page(forged).ok();
    }
    damaged.mend(at, 1);
    ASSERT_TRUE(file->read_page(top).ok());
  }
  EXPECT_GT(decodes, 100u);  // so only the second checksum can notice
}

}  // namespace

}  // namespace clamor::testing
