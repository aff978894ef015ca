#include "wire/endpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <string>
#include <vector>

#include "support/temporary_folder.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace endpoint_test {

using ::testing::HasSubstr;

TEST(Endpoint, IsLocalOnlyIfNoOtherMachineCanReachIt) {
  for (const char* local : {"tcp://127.0.0.1:5570", "tcp://127.3.2.1:*", "tcp://localhost:5570", "tcp://[::1]:5570",
                            "ipc:///run/mocapd/feed"}) {
    EXPECT_TRUE(is_local(local)) << local;
  }
  for (const char* open :
       {"tcp://*:5570", "tcp://0.0.0.0:5570", "tcp://eth0:5570", "tcp://192.168.1.2:5570", "tcp://[::]:5570",
        "tcp://127.example.org:5570", "tcp://127.0.0.1.example.org:1", "udp://127.0.0.1:1"}) {
    EXPECT_FALSE(is_local(open)) << open;
  }
}

TEST(Endpoint, RemoteNeedsAllowRemote) {
  EXPECT_TRUE(check_endpoint("tcp://127.0.0.1:5570", false));
  EXPECT_TRUE(check_endpoint("tcp://*:5570", true));
  ASSERT_FALSE(check_endpoint("tcp://*:5570", false));
  EXPECT_THAT(check_endpoint("tcp://*:5570", false).error().message, HasSubstr("allow_remote = true"));
}

TEST(Endpoint, MalformedIsRejected) {
  for (const char* wrong : {"", "5570", "tcp://", "tcp://127.0.0.1", "tcp://127.0.0.1:", "tcp://127.0.0.1:99999",
                            "tcp://127.0.0.1:55x", "tcp://:5570", "ipc://", "http://127.0.0.1:80", "inproc://x"}) {
    const Status checked = check_endpoint(wrong, true);
    ASSERT_FALSE(checked) << wrong;
    EXPECT_EQ(checked.error().code, ErrorCode::InvalidArgument) << wrong;
  }
  EXPECT_FALSE(check_endpoint("ipc://" + std::string(200, 'x'), false));
}

TEST(Endpoint, IsTriedBeforeTheDaemonGivesUpItsOwn) {
  ZmqContext context;
  ZmqSocket other;
  ASSERT_TRUE(other.open(context, ZMQ_ROUTER, "test"));
  ASSERT_EQ(zmq_bind(other.get(), "tcp://127.0.0.1:*"), 0);
  const std::string taken = other.last_endpoint(), port = taken.substr(taken.rfind(':'));

  EXPECT_TRUE(try_endpoints({"tcp://127.0.0.1:*", "tcp://127.0.0.1:*"}, {}));
  EXPECT_EQ(try_endpoints({"tcp://127.0.0.1:*", taken}, {}).error().code, ErrorCode::Busy);
  EXPECT_TRUE(try_endpoints({taken}, {taken}));
  EXPECT_TRUE(try_endpoints({"tcp://*" + port}, {taken})) << "the port is free then";
  EXPECT_EQ(try_endpoints({"tcp://198.51.100.7" + port}, {taken}).error().code, ErrorCode::NotFound);
}

TEST(Endpoint, IsNotGivenTwice) {
  const std::vector<std::string> own{"tcp://127.0.0.1:5570", "tcp://127.0.0.1:5571"};

  EXPECT_TRUE(try_endpoints({own[1], own[0]}, own)) << "the ports are exchanged";
  EXPECT_TRUE(try_endpoints({"tcp://0.0.0.0:5570", "tcp://[::1]:5570"}, {own[0], "tcp://[::1]:5570"}));
  EXPECT_EQ(try_endpoints({own[0], own[0]}, own).error().code, ErrorCode::Busy);
  EXPECT_EQ(try_endpoints({own[0], "tcp://*:5570"}, own).error().code, ErrorCode::Busy);
  EXPECT_EQ(try_endpoints({"ipc:///tmp/feed", "ipc:///tmp/feed"}, {}).error().code, ErrorCode::Busy);
}

TEST(Endpoint, OfAnIpcFileNeedsAFolderThatCanBeWritten) {
  const support::TemporaryFolder folder;

  EXPECT_TRUE(try_endpoints({"ipc://" + (folder.path() / "feed").string(), "ipc://@feed", "ipc://*"}, {}));
  EXPECT_EQ(try_endpoints({"ipc://" + (folder.path() / "absent/feed").string()}, {}).error().code, ErrorCode::Io);
}

}  // namespace endpoint_test
}  // namespace mocap::wire
