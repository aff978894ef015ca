#include "lib/cli/status_line.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace mocap::cli {
namespace status_line_test {

constexpr int kLimit_ms = 60'000;  // of a failing test

// Standard error is a terminal, whose other end the test reads.
class Terminal {
 public:
  Terminal() : mine_(::posix_openpt(O_RDWR | O_NOCTTY)), before_(::dup(STDERR_FILENO)) {
    ::grantpt(mine_);
    ::unlockpt(mine_);
    const int theirs = ::open(::ptsname(mine_), O_RDWR | O_NOCTTY);
    ::dup2(theirs, STDERR_FILENO);
    ::close(theirs);
  }
  ~Terminal() {
    ::dup2(before_, STDERR_FILENO);
    ::close(before_);
    ::close(mine_);
  }

  // Waits for so many bytes, which the kernel passes on in its own time.
  std::string read(std::size_t size) const {
    std::string text;
    pollfd readable{mine_, POLLIN, 0};
    while (text.size() < size && ::poll(&readable, 1, kLimit_ms) == 1) {
      char bytes[256];
      const ssize_t count = ::read(mine_, bytes, sizeof bytes);
      if (count <= 0) break;
      text.append(bytes, static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  int mine_, before_;
};

TEST(StatusLine, OverwritesItselfAndIsErasedAtItsEnd) {
  const std::string expected = "\r\033[K1 of 2\r\033[K2 of 2\r\033[K";
  std::string text;
  {
    const Terminal terminal;
    {
      StatusLine line;
      EXPECT_TRUE(line.on_terminal());
      line.show("1 of 2");
      line.show("2 of 2");
    }
    text = terminal.read(expected.size());
  }

  EXPECT_EQ(text, expected);
}

TEST(StatusLine, PrintsNothingWithoutATerminal) {
  testing::internal::CaptureStderr();
  {
    StatusLine line;
    EXPECT_FALSE(line.on_terminal());
    line.show("1 of 2");
  }

  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace status_line_test
}  // namespace mocap::cli
