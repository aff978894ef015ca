#include "cameras/node/node_clock.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

namespace mocap::cameras {
namespace node_clock_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kSession = 7;

Timestamp host_at(Duration since_begin) { return from_ns(1'000'000'000'000) + since_begin; }
// The node's clock is 20 ms ahead and gains 30 ppm.
Timestamp node_at(Timestamp host) { return host + milliseconds(20) + from_s(30e-6 * to_s(host - host_at({}))); }

// An echo with delays of 100 us, of which each direction has up to 2 ms more.
Echo echo_at(Timestamp called_at, std::mt19937& random) {
  std::exponential_distribution<> more_s(2000.0);
  const Timestamp received = called_at + microseconds(100) + from_s(more_s(random));
  const Timestamp sent = received + microseconds(30);
  return {called_at, node_at(received), node_at(sent), sent + microseconds(100) + from_s(more_s(random))};
}

Echo good_echo_at(Timestamp called_at) {
  const Timestamp received = called_at + microseconds(100);
  return {called_at, node_at(received), node_at(received), received + microseconds(100)};
}

Timestamp converted(NodeClock& clock, Timestamp node, std::uint64_t session = kSession) {
  const auto instants = clock.to_host(session, node, node, host_at({}));
  EXPECT_TRUE(instants);
  return instants ? instants->exposed_at : Timestamp{};
}

TEST(NodeClock, ConvertsAnInstantOfTheNodeTheSameWayForAllCameras) {
  std::mt19937 random(3);
  NodeClock clock;
  clock.add(kSession, good_echo_at(host_at({})));
  std::vector<Timestamp> exposures, first;

  // One camera converts each exposure at once, another one half a second later; echoes come all the time.
  for (int i = 1; i < 600; ++i) {
    const Timestamp now = host_at(milliseconds(8) * i);
    if (i % 2 == 0) clock.add(kSession, echo_at(now, random));
    exposures.push_back(node_at(now));
    first.push_back(converted(clock, exposures.back()));
    if (i > 60) {
      const std::size_t before = exposures.size() - 60;
      EXPECT_EQ(converted(clock, exposures[before]), first[before]);
    }
  }

  EXPECT_LT(std::abs(to_us(first.back() - host_at(milliseconds(8) * 599))), 300.0);
}

TEST(NodeClock, NeverUsesAnEstimateForInstantsBeforeThoseConverted) {
  std::mt19937 random(5);
  NodeClock clock;
  clock.add(kSession, good_echo_at(host_at({})));
  const Timestamp late = node_at(host_at(milliseconds(300)));
  const Timestamp before = converted(clock, late);

  for (int i = 1; i < 20; ++i) clock.add(kSession, echo_at(host_at(milliseconds(20) * i), random));

  EXPECT_EQ(converted(clock, late), before);
}

TEST(NodeClock, BeginsAnewWithAnotherSession) {
  NodeClock clock;
  for (int i = 0; i < 50; ++i) clock.add(kSession, good_echo_at(host_at(milliseconds(20) * i)));
  converted(clock, node_at(host_at(seconds(1))));
  const Echo late = good_echo_at(host_at(milliseconds(999)));

  // The node restarts with its machine: its clock begins at zero.
  Echo echo = good_echo_at(host_at(seconds(2)));
  echo.received_at = echo.sent_at = from_ns(5'000'000'000);
  clock.add(kSession + 1, echo);
  clock.add(kSession, late);  // on its way during the restart

  EXPECT_FALSE(clock.to_host(kSession, late.sent_at, late.sent_at, host_at(seconds(2))));
  EXPECT_LT(std::abs(to_us(converted(clock, echo.sent_at, kSession + 1) - host_at(seconds(2)))), 101.0);
}

TEST(NodeClock, FollowsANodeWhoseClockWasSetBack) {
  NodeClock clock;
  for (int i = 0; i < 100; ++i) clock.add(kSession, good_echo_at(host_at(milliseconds(100) * i)));
  converted(clock, node_at(host_at(seconds(10))));

  Echo echo;
  for (int i = 0; i < 30; ++i) {
    echo = good_echo_at(host_at(seconds(11) + milliseconds(100) * i));
    echo.received_at -= seconds(8);
    echo.sent_at -= seconds(8);
    clock.add(kSession, echo);
  }

  EXPECT_LT(std::abs(to_us(converted(clock, echo.sent_at) - (echo.called_at + microseconds(100)))), 200.0);
}

TEST(NodeClock, IsNotHeldBackByAnExposureThatIsFarAhead) {
  NodeClock clock;
  clock.add(kSession, good_echo_at(host_at({})));
  converted(clock, node_at(host_at(seconds(100'000))));

  for (int i = 1; i < 300; ++i) clock.add(kSession, good_echo_at(host_at(milliseconds(100) * i)));

  const Timestamp now = host_at(seconds(30));
  EXPECT_LT(std::abs(to_us(converted(clock, node_at(now)) - now)), 100.0);
}

TEST(NodeClock, AsksForFewerEchoesOfEachCameraTheMoreCamerasShareIt) {
  NodeClock clock;
  EXPECT_EQ(clock.call_every(), milliseconds(100));
  clock.join();
  EXPECT_EQ(clock.call_every(), milliseconds(100));
  clock.join();
  EXPECT_EQ(clock.call_every(), milliseconds(200));
  for (int i = 2; i < 64; ++i) clock.join();
  EXPECT_EQ(clock.call_every(), milliseconds(250));  // a node forgets a host after a second
  for (int i = 1; i < 64; ++i) clock.leave();
  EXPECT_EQ(clock.call_every(), milliseconds(100));
}

TEST(NodeClock, SaysHowWellItIsKnown) {
  NodeClock clock;
  EXPECT_FALSE(clock.state(kSession, host_at({})));
  EXPECT_FALSE(clock.to_host(kSession, host_at({}), host_at({}), host_at({})));

  clock.add(kSession, good_echo_at(host_at({})));

  const auto state = clock.state(kSession, host_at({}));
  ASSERT_TRUE(state);
  EXPECT_EQ(state->round_trip, microseconds(200));
  EXPECT_GT(state->uncertainty, Duration::zero());
  EXPECT_LT(state->uncertainty, microseconds(100));
}

// For the thread sanitizer.
TEST(NodeClock, IsSharedByThreads) {
  NodeClock clock;
  clock.add(kSession, good_echo_at(host_at({})));
  std::atomic<bool> all_known{true};
  {
    std::vector<std::jthread> cameras;
    for (unsigned camera = 0; camera < 4; ++camera) {
      cameras.emplace_back([&, camera] {
        std::mt19937 random(camera);
        for (int i = 0; i < 500; ++i) {
          const Timestamp now = host_at(milliseconds(10) * i);
          clock.add(kSession, echo_at(now, random));
          if (!clock.to_host(kSession, node_at(now), node_at(now), now)) all_known = false;
        }
      });
    }
  }

  EXPECT_TRUE(all_known);
}

TEST(NodeClocks, HaveOneClockForEachNode) {
  NodeClocks clocks;

  NodeClock& left = clocks.of("tcp://10.0.0.1:5575");

  EXPECT_EQ(&clocks.of("tcp://10.0.0.1:5575"), &left);
  EXPECT_NE(&clocks.of("tcp://10.0.0.2:5575"), &left);
}

}  // namespace node_clock_test
}  // namespace mocap::cameras
