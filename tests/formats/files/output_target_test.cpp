#include "formats/files/output_target.h"

#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "formats/files/atomic_file.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;

class Outputs : public ::testing::Test {
 protected:
  Outputs() {
    std::string name = (fs::temp_directory_path() / "clamor_outputs_XXXXXX").string();
    folder_ = fs::canonical(::mkdtemp(name.data()));
    fs::create_directory(folder_ / "real");
    fs::create_directory_symlink("real", folder_ / "folder_link");
  }
  ~Outputs() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return at(name);
  }
  static std::string text_of(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::string why_not(const std::string& path, const InputFiles& inputs = {}) {
    const auto target = OutputTarget::find(path, inputs);
    return target.ok() ? "" : target.error().message;
  }

  fs::path folder_;
};

TEST_F(Outputs, MayHaveTheLongestNamesOfAFileSystem) {
  const std::string path = at(std::string(255, 'n'));
  const auto written = write_file(path, "text");
  ASSERT_TRUE(written.ok()) << written.error().message;
  EXPECT_EQ(text_of(path), "text");
}

TEST_F(Outputs, FollowAllLinks) {
  fs::create_symlink("link2", folder_ / "link1");
  fs::create_symlink("folder_link/new", folder_ / "link2");
  for (const char* name : {"link1", "link2", "folder_link/new", "real/new", "real/../real/new"}) {
    const auto target = OutputTarget::find(at(name));
    ASSERT_TRUE(target.ok()) << target.error().message;
    EXPECT_FALSE(target->is_stream());
    EXPECT_EQ(target->file(), at("real/new")) << name;
  }
  EXPECT_TRUE(fs::is_empty(folder_ / "real")) << "looking makes nothing";

  auto file = AtomicFile::create(at("link1"));
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->write(std::as_bytes(std::span("text", 4))).ok());
  ASSERT_TRUE(file->commit().ok());
  EXPECT_EQ(text_of(at("real/new")), "text");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link1") && fs::is_symlink(folder_ / "link2"));
}

TEST_F(Outputs, MayBeStreamsButNotFoldersSocketsOrCyclicLinks) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  fs::create_symlink("/dev/null", folder_ / "null");
  for (const std::string& path : {at("pipe"), at("null"), std::string("/dev/null"),
                                  std::string("/dev/stdout"), std::string("/dev/fd/1")}) {
    const auto target = OutputTarget::find(path);
    ASSERT_TRUE(target.ok()) << target.error().message;
    EXPECT_TRUE(target->is_stream()) << path;
    EXPECT_EQ(target->is_stdout(), path == "/dev/stdout" || path == "/dev/fd/1") << path;
  }

  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  at("socket").copy(address.sun_path, sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ::close(socket);
  fs::create_symlink("circle", folder_ / "circle");
  const struct {
    std::string path, words;
  } cases[] = {{at("real"), "is a folder"},         {at("real/"), "is a folder"},
               {at("folder_link"), "is a folder"},  {at("socket"), "is a socket"},
               {at("circle"), "cannot write"},      {at("no/such/file"), "does not exist"},
               {at("pipe/file"), "does not exist"}, {"", "empty"}};
  for (const auto& [path, words] : cases)
    EXPECT_NE(why_not(path).find(words), std::string::npos) << path << ": " << why_not(path);
}

TEST_F(Outputs, AreNeverInputsUnderAnyName) {
  const std::string input = put("real/input", "precious");
  fs::create_symlink("real/input", folder_ / "link");
  fs::create_hard_link(input, folder_ / "twin");
  InputFiles inputs;
  inputs.add(at("folder_link/input"));
  inputs.add(at("no such file"));
  inputs.add("");
  for (const char* name : {"real/input", "folder_link/input", "link", "twin", "real/../link"}) {
    EXPECT_NE(why_not(at(name), inputs).find("name another output"), std::string::npos) << name;
    EXPECT_EQ(why_not(at(name)), "") << name;
  }
  EXPECT_EQ(why_not(put("real/equal", "precious"), inputs), "") << "equal, but another file";
}

TEST_F(Outputs, ToAnOpenDescriptorContinueAtItsPosition) {
  const std::string path = put("log", "before ");
  const int log = ::open(path.c_str(), O_WRONLY | O_APPEND);
  auto file = AtomicFile::create("/dev/fd/" + std::to_string(log));
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_TRUE(file->write(std::as_bytes(std::span("??er", 4))).ok());
  ASSERT_TRUE(file->write_at(0, std::as_bytes(std::span("af", 2))).ok());
  EXPECT_EQ(text_of(path), "before ") << "a stream gets what is complete";
  ASSERT_TRUE(file->commit().ok());
  EXPECT_EQ(text_of(path), "before afer");
  const int only_read = ::open(path.c_str(), O_RDONLY);
  EXPECT_NE(why_not("/dev/fd/" + std::to_string(only_read)), "");
  ::close(only_read);
  ::close(log);
}

TEST_F(Outputs, AreNeverATerminal) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(terminal, 0);
  EXPECT_NE(why_not("/dev/fd/" + std::to_string(terminal)).find("terminal"), std::string::npos);
  ::close(terminal);
}

TEST_F(Outputs, ThatAppearImmediatelyGrowAndRemain) {
  const std::string path = put("file", "older");
  {
    auto file = AtomicFile::create(path);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->write(std::as_bytes(std::span("ab", 2))).ok());
    EXPECT_EQ(text_of(path), "older");
    ASSERT_TRUE(file->appear().ok());
    EXPECT_EQ(text_of(path), "ab");
    ASSERT_TRUE(file->write(std::as_bytes(std::span("cd", 2))).ok());
    ASSERT_TRUE(file->write_at(0, std::as_bytes(std::span("A", 1))).ok());
  }
  EXPECT_EQ(text_of(path), "Abcd");
}

}  // namespace
}  // namespace clamor
