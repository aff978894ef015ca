#include "base/read_file.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace mocap {
namespace read_file_test {

using ::testing::HasSubstr;

TEST(ReadFile, GivesEveryByte) {
  const support::TemporaryFolder folder;
  const std::string bytes = std::string(200'000, 'a') + std::string("\0\r\n\xff", 4);

  const Result<std::string> read = read_file(folder.write("a.bin", bytes));

  ASSERT_TRUE(read);
  EXPECT_EQ(*read, bytes);
}

TEST(ReadFile, TellsAMissingFileFromOneThatCannotBeRead) {
  const support::TemporaryFolder folder;
  // Its open succeeds and its first read fails with EIO, as on a disk with a fault.
  const Result<std::string> fault = read_file("/proc/self/mem");
  const Result<std::string> missing = read_file(folder.path() / "none.toml");
  const Result<std::string> not_a_file = read_file(folder.path());

  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("none.toml' cannot be read: No such file"));
  EXPECT_EQ(fault.error().code, ErrorCode::Io);
  EXPECT_THAT(fault.error().message, HasSubstr("Input/output error"));
  EXPECT_EQ(not_a_file.error().code, ErrorCode::Io);
}

TEST(ReadFile, RefusesALargerFileThanExpected) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.write("a.txt", "12345");

  EXPECT_TRUE(read_file(path, 5));
  EXPECT_EQ(read_file(path, 4).error().code, ErrorCode::InvalidArgument);
}

}  // namespace read_file_test
}  // namespace mocap
