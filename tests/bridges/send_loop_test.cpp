#include "bridges/udp/send_loop.h"

#include <gtest/gtest.h>

#include <csignal>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace mocap::bridge {
namespace send_loop_test {

// Asks the program to end when the feed is silent.
class Ending : public PacketWriter {
 public:
  const std::vector<std::string>& write(const ClientFrame* frame, double /*time_s*/) override {
    EXPECT_EQ(frame, nullptr);
    std::raise(SIGTERM);
    return none_;
  }

 private:
  std::vector<std::string> none_;
};

TEST(SendLoop, ASignalBeforeTheFirstFrameIsNoFailure) {
  const support::TemporaryFolder folder;
  sigset_t ends;  // another test of this program may have blocked it
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
  SendOptions options;
  options.feed.endpoint = "tcp://127.0.0.1:1";  // nothing listens there
  options.port = "9";
  options.status_file = folder.path() / "status.json";
  Ending writer;

  EXPECT_EQ(send_until_stopped("test", options, writer), 0);
}

}  // namespace send_loop_test
}  // namespace mocap::bridge
