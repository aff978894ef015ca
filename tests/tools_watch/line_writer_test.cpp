#include "watch/line_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <thread>
#include <utility>

namespace mocap::watch {
namespace line_writer_test {

class LineWriterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(::pipe2(ends_, O_CLOEXEC), 0);
    line_ += '\n';
  }
  void TearDown() override {
    for (int end : ends_) ::close(end);
  }

  // Reads until the line is whole or nothing comes any more.
  std::string read_line() const {
    std::string text;
    char block[1000];
    while (text.size() < line_.size()) {
      const ssize_t count = ::read(ends_[0], block, sizeof block);
      if (count <= 0) break;
      text.append(block, static_cast<std::size_t>(count));
    }
    return text;
  }

  int ends_[2] = {-1, -1};
  std::string line_ = std::string(200'000, 'x');  // more than a pipe holds
};

TEST_F(LineWriterTest, WaitsForTheReader) {
  const LineWriter writer(ends_[1], [] { return false; });
  std::string got;
  std::jthread reader([&] { got = read_line(); });

  EXPECT_TRUE(writer.write(line_));

  reader.join();
  EXPECT_EQ(got, line_);
}

TEST_F(LineWriterTest, WritesTheRestOfTheLineAfterAStop) {
  int looks = 0;
  const LineWriter writer(ends_[1], [&] { return ++looks > 2; });  // asked in the middle of the line
  std::string got;
  std::jthread reader([&] { got = read_line(); });

  EXPECT_TRUE(writer.write(line_));

  reader.join();
  EXPECT_EQ(got, line_);
}

TEST_F(LineWriterTest, GivesUpAfterAStopIfNobodyReads) {
  const LineWriter writer(ends_[1], [] { return true; });

  EXPECT_FALSE(writer.write(line_));
}

TEST_F(LineWriterTest, EndsIfTheReaderIsGone) {
  std::signal(SIGPIPE, SIG_IGN);
  ::close(std::exchange(ends_[0], -1));
  const LineWriter writer(ends_[1], [] { return false; });

  EXPECT_FALSE(writer.write(line_));
  std::signal(SIGPIPE, SIG_DFL);
}

}  // namespace line_writer_test
}  // namespace mocap::watch
