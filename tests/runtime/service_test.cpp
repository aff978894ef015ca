#include "runtime/process/service.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "support/temporary_folder.h"

namespace mocap::runtime {
namespace service_test {

// Plays systemd: a datagram socket whose path is in the environment.
class ServiceManager : public testing::Test {
 protected:
  void SetUp() override {
    const std::string path = (folder_.path() / "notify").string();
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(path.size(), sizeof address.sun_path);
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    ASSERT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  void TearDown() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "JOURNAL_STREAM"}) ::unsetenv(name);
    ::close(socket_);
  }

  std::string heard() const {
    char text[1024];
    const ssize_t length = ::recv(socket_, text, sizeof text, 0);
    return length < 0 ? "" : std::string(text, static_cast<std::size_t>(length));
  }

  support::TemporaryFolder folder_;
  int socket_ = -1;
};

TEST_F(ServiceManager, ReceivesReadinessProgressAndStop) {
  Service service;

  service.ready("4 of 4 cameras");
  EXPECT_EQ(heard(), "READY=1\nSTATUS=4 of 4 cameras");
  service.alive();
  EXPECT_EQ(heard(), "WATCHDOG=1");
  service.stopping();
  EXPECT_EQ(heard(), "STOPPING=1\nSTATUS=stopping");
}

TEST_F(ServiceManager, ReceivesEachStatusOnceInOneLine) {
  Service service;

  service.status("3 of 4 cameras\nWATCHDOG=1");
  service.status("3 of 4 cameras\nWATCHDOG=1");

  EXPECT_EQ(heard(), "STATUS=3 of 4 cameras WATCHDOG=1");
  EXPECT_EQ(heard(), "");
}

TEST_F(ServiceManager, GetsTwoKeepAlivesPerWatchdogPeriod) {
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);

  EXPECT_EQ(Service().watchdog_interval(), std::chrono::milliseconds(1500));
}

TEST_F(ServiceManager, GetsNoKeepAliveIfItWatchesAnotherProcess) {
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  ::setenv("WATCHDOG_PID", "1", 1);

  EXPECT_EQ(Service().watchdog_interval(), Duration{0});
}

TEST_F(ServiceManager, ReadsStandardErrorIfTheJournalIsConnected) {
  struct stat stderr_status {};
  ASSERT_EQ(::fstat(STDERR_FILENO, &stderr_status), 0);
  ::setenv("JOURNAL_STREAM",
           (std::to_string(stderr_status.st_dev) + ":" + std::to_string(stderr_status.st_ino)).c_str(), 1);
  EXPECT_TRUE(Service().logs_to_journal());

  ::setenv("JOURNAL_STREAM", "1:1", 1);  // another file, as after a redirection
  EXPECT_FALSE(Service().logs_to_journal());
}

TEST(Service, SendsNothingIfStartedByHand) {
  Service service;

  service.ready("alone");
  service.alive();
  service.stopping();

  EXPECT_EQ(service.watchdog_interval(), Duration{0});
  EXPECT_FALSE(service.logs_to_journal());
}

}  // namespace service_test
}  // namespace mocap::runtime
