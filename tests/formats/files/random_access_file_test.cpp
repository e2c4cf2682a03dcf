#include "formats/files/random_access_file.h"

#include <atomic>
#include <csignal>
#include <cstring>
#include <thread>

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "formats/bake_file/bake_layout.h"
#include "tests/formats/bake_examples.h"
#include "tests/sanitized.h"
#include "tests/temporary_file.h"

namespace clamor::testing {
namespace {

constexpr std::array kWays = {FileAccess::kRead, FileAccess::kMap};

// Contents without repetitions or zeros.
std::string some_bytes(std::size_t size) {
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < size; ++i)
    bytes[i] = static_cast<char>(1 + philox(5, {static_cast<std::uint32_t>(i), 0, 0, 0})[0] % 255);
  return bytes;
}

// Reads a range and accepts only its original contents.
Result<std::string> text_of(const RandomAccessFile& file, std::size_t offset,
                            const std::string& expected) {
  std::vector<std::byte> copy;
  std::string text;
  const auto done = file.with(
      offset, expected.size(), copy, [&](std::span<const std::byte> bytes, bool) -> Result<void> {
        text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        return text == expected ? Result<void>() : Error("is different");
      });
  if (!done.ok()) return done.error();
  return text;
}

TEST(RandomAccessFile, IsEquivalentMappedAndRead) {
  const std::string bytes = some_bytes(40'001);
  const TemporaryFile stored(".bin", bytes);
  for (const FileAccess way : kWays) {
    const auto file = RandomAccessFile::open(stored.path(), way);
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->is_mapped(), way == FileAccess::kMap);
    EXPECT_EQ(file->size(), bytes.size());
    for (const std::size_t offset : {0, 1, 4095, 4096, 12'345, 40'000})
      for (const std::size_t size : {0, 1, 4097, 20'000}) {
        const std::string part = bytes.substr(offset, size);
        file->will_need(offset, part.size());
        EXPECT_TRUE(text_of(*file, offset, part).ok()) << offset << " " << size;
      }
    EXPECT_FALSE(text_of(*file, 40'000, "beyond its end").ok());
    EXPECT_FALSE(text_of(*file, std::size_t{1} << 62, "beyond its end").ok());
  }
}

TEST(RandomAccessFile, ThatShrinksIsAnErrorUntilItGrowsAgain) {
  const std::string bytes = some_bytes(10 * 4096 + 100);
  // The handler is called with and without SIGBUS blocked.
  sigset_t bus_error, before, after;
  ::sigemptyset(&bus_error);
  ::sigaddset(&bus_error, SIGBUS);
  for (const int how : {SIG_UNBLOCK, SIG_BLOCK}) {
    ::pthread_sigmask(how, &bus_error, nullptr);
    ::pthread_sigmask(SIG_SETMASK, nullptr, &before);
    for (const FileAccess way : kWays) {
      const TemporaryFile stored(".bin", bytes);
      const auto file = RandomAccessFile::open(stored.path(), way);
      ASSERT_TRUE(file.ok());
      for (const std::size_t length : {5 * 4096, 5 * 4096 + 7, 0}) {
        std::filesystem::resize_file(stored.path(), length);
        const auto cut = text_of(*file, 4096, bytes.substr(4096, 8 * 4096));
        ASSERT_FALSE(cut.ok()) << length;
        EXPECT_NE(cut.error().message.find("cut short while it was open"), std::string::npos)
            << cut.error().message;
        if (length > 0) {
          EXPECT_TRUE(text_of(*file, 100, bytes.substr(100, 4 * 4096)).ok());
        }
        std::ofstream(stored.path(), std::ios::binary) << bytes;
        EXPECT_TRUE(text_of(*file, 0, bytes).ok()) << length;
      }
    }
    ::pthread_sigmask(SIG_SETMASK, nullptr, &after);
    EXPECT_EQ(::sigismember(&after, SIGBUS), ::sigismember(&before, SIGBUS));
  }
  ::pthread_sigmask(SIG_UNBLOCK, &bus_error, nullptr);
}

// Simulates a disk that succeeds at the second attempt.
TEST(RandomAccessFile, IsReadIfItsMappingFaults) {
  const std::string bytes = some_bytes(8 * 4096);
  const TemporaryFile stored(".bin", bytes);
  const auto file = RandomAccessFile::open(stored.path(), FileAccess::kMap);
  ASSERT_TRUE(file.ok());
  std::filesystem::resize_file(stored.path(), 4096);
  std::vector<std::byte> copy;
  std::vector<std::string> seen;
  const auto done = file->with(
      0, bytes.size(), copy, [&](std::span<const std::byte> range, bool) -> Result<void> {
        seen.emplace_back(reinterpret_cast<const char*>(range.data()), range.size());
        std::ofstream(stored.path(), std::ios::binary) << bytes;
        return {};
      });
  EXPECT_TRUE(done.ok());
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0], bytes.substr(0, 4096) + std::string(7 * 4096, '\0'));
  EXPECT_TRUE(seen[1] == bytes);
}

TEST(RandomAccessFile, IsCorrectOrAnErrorOnAllThreadsWhileItsSizeChanges) {
  const std::string bytes = some_bytes(16 * 4096);
  const TemporaryFile stored(".bin", bytes);
  const auto file = RandomAccessFile::open(stored.path(), FileAccess::kMap);
  ASSERT_TRUE(file.ok());
  std::atomic<bool> over{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> readers;
  for (std::size_t i = 0; i < 4; ++i)
    readers.emplace_back([&, i] {
      const std::string part = bytes.substr(i * 3000, 9000);
      while (!over) {
        const auto text = text_of(*file, i * 3000, part);
        if (text.ok() && *text != part) ++wrong;
      }
    });
  for (int i = 0; i < 300; ++i) {
    std::filesystem::resize_file(stored.path(), static_cast<std::size_t>(i % 5) * 3000);
    std::ofstream(stored.path(), std::ios::binary) << bytes;
  }
  over = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_TRUE(text_of(*file, 0, bytes).ok());
}

TEST(FileVersion, ChangesIfTheFileIsReplacedOrModified) {
  const TemporaryFile stored(".bin", "one");
  const auto file = RandomAccessFile::open(stored.path(), FileAccess::kRead);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file_version(stored.path()), file->version());
  std::ofstream(stored.path(), std::ios::app) << " and more";
  ASSERT_TRUE(file_version(stored.path()).has_value());
  EXPECT_NE(file_version(stored.path()), file->version());
  EXPECT_TRUE(file_version(stored.path())->is_same_file(file->version()));
  const TemporaryFile next(".bin", "one");
  std::filesystem::rename(next.path(), stored.path());
  EXPECT_FALSE(file_version(stored.path())->is_same_file(file->version()));
  std::filesystem::remove(stored.path());
  EXPECT_FALSE(file_version(stored.path()).has_value());
}

// A page mapped beyond the end of its file, which faults.
const volatile char* untouchable() {
  const TemporaryFile stored(".bin", "");
  const int descriptor = ::open(stored.path().c_str(), O_RDONLY | O_CLOEXEC);
  const void* const memory = ::mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE, descriptor, 0);
  ::close(descriptor);
  return static_cast<const volatile char*>(memory);
}

// Calls `then` while a guard is active in this thread.
template <class Then>
void while_guarded(const Then& then) {
  const TemporaryFile stored(".bin", some_bytes(4096));
  const auto file = RandomAccessFile::open(stored.path(), FileAccess::kMap);
  std::vector<std::byte> copy;
  (void)file->with(0, 4096, copy, [&](std::span<const std::byte>, bool) -> Result<void> {
    then();
    return {};
  });
}

constexpr int kOwnHandler = 42, kNothingHappened = 43;

void install_own_handler(int flags) {
  struct sigaction action {};
  action.sa_flags = flags;
  if ((flags & SA_SIGINFO) != 0)
    action.sa_sigaction = [](int, siginfo_t* information, void* context) {
      ::_exit(information != nullptr && context != nullptr ? kOwnHandler : 1);
    };
  else
    action.sa_handler = [](int) { ::_exit(kOwnHandler); };
  ::sigaction(SIGBUS, &action, nullptr);
}

// Runs each case in its own process, because handlers are per process.
class BusErrorGuardDeathTest : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_P(BusErrorGuardDeathTest, PassesOtherFaultsAndSentSignalsToThePreviousHandler) {
  const auto in_another_thread = [] {
    install_own_handler(GetParam());
    while_guarded([] { std::thread([] { (void)*untouchable(); }).join(); });
    ::_exit(kNothingHappened);
  };
  EXPECT_EXIT(in_another_thread(), ::testing::ExitedWithCode(kOwnHandler), "");
  const auto at_another_address = [] {
    install_own_handler(GetParam());
    while_guarded([] { (void)*untouchable(); });
    ::_exit(kNothingHappened);
  };
  EXPECT_EXIT(at_another_address(), ::testing::ExitedWithCode(kOwnHandler), "");
  const auto sent = [] {
    install_own_handler(GetParam());
    while_guarded([] { ::raise(SIGBUS); });
    ::_exit(kNothingHappened);
  };
  EXPECT_EXIT(sent(), ::testing::ExitedWithCode(kOwnHandler), "");
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutInformation, BusErrorGuardDeathTest,
                         ::testing::Values(0, SA_SIGINFO));

TEST(NoHandlerBeforeDeathTest, KeepsTheDefaultActionOfUnrelatedSignals) {
  if (kSanitized) GTEST_SKIP() << "sanitizers have a handler";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto touch = [](void (*before)(int)) {
    ::signal(SIGBUS, before);
    while_guarded([] { (void)*untouchable(); });
    ::_exit(kNothingHappened);
  };
  const auto send = [](void (*before)(int)) {
    ::signal(SIGBUS, before);
    while_guarded([] { ::raise(SIGBUS); });
    ::_exit(kNothingHappened);
  };
  EXPECT_EXIT(touch(SIG_DFL), ::testing::KilledBySignal(SIGBUS), "");
  EXPECT_EXIT(touch(SIG_IGN), ::testing::KilledBySignal(SIGBUS), "");
  EXPECT_EXIT(send(SIG_DFL), ::testing::KilledBySignal(SIGBUS), "");
  EXPECT_EXIT(send(SIG_IGN), ::testing::ExitedWithCode(kNothingHappened), "");
}

TEST(NoHandlerBeforeDeathTest, IsNotInstalledWithoutMapping) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto read_only = [] {
    install_own_handler(SA_SIGINFO);
    struct sigaction before, after;
    ::sigaction(SIGBUS, nullptr, &before);
    const TemporaryFile stored(".bin", "bytes");
    (void)RandomAccessFile::open(stored.path(), FileAccess::kRead).ok();
    ::sigaction(SIGBUS, nullptr, &after);
    ::_exit(before.sa_sigaction == after.sa_sigaction ? 0 : 1);
  };
  EXPECT_EXIT(read_only(), ::testing::ExitedWithCode(0), "");
}

// The process may have no more files open than it has.
TEST(RandomAccessFile, ThatTheLimitOfOpenFilesKeepsShutNamesTheLimit) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 3;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  const auto opened = RandomAccessFile::open("/dev/null", FileAccess::kRead);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("raise the limit with ulimit -n"), std::string::npos)
      << opened.error().message;
}

}  // namespace
}  // namespace clamor::testing
