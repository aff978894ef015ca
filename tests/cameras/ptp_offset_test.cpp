#include "cameras/clock/ptp_offset.h"

#include <gtest/gtest.h>

#include <chrono>

namespace mocap::cameras {
namespace ptp_offset_test {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

// The host is 3 ppm slower than PTP; the peer is 20 ms ahead of the host and 50 ppm faster than PTP.
constexpr double kHostRate = 3e-6, kPeerRate = -50e-6;
constexpr Duration kBegin = nanoseconds(1'795'772'164'700'852'004);

PtpLine host_line(Timestamp at) {
  const Duration age = at - from_ns(5'000'000'000);
  return {7, at, kBegin + age + from_s(kHostRate * to_s(age)), kHostRate, nanoseconds(300)};
}
// The peer's clock shows 8 s when PTP shows kBegin.
PtpLine peer_line(Timestamp at) {
  const Duration age = at - from_ns(8'000'000'000);
  return {7, at, kBegin + age + from_s(kPeerRate * to_s(age)), kPeerRate, nanoseconds(400)};
}

TEST(PtpOffset, ConvertsInstantsOfThePeerByTheirPtpTime) {
  const auto measured = ptp_offset(peer_line(from_ns(9'000'000'000)), host_line(from_ns(6'200'000'000)));
  ASSERT_TRUE(measured);

  for (const Duration later : {Duration{}, Duration(milliseconds(500)), Duration(seconds(2))}) {
    const Timestamp peer = from_ns(9'000'000'000) + later;
    const Timestamp host = measured->line.to_host(peer);

    EXPECT_LE(std::abs((host_line(host).ptp - peer_line(peer).ptp).count()), 2);
  }
  EXPECT_EQ(measured->uncertainty, nanoseconds(500));
}

TEST(PtpOffset, IsUnknownBetweenTwoGrandmasters) {
  PtpLine peer = peer_line(from_ns(9'000'000'000));
  peer.grandmaster = 8;

  EXPECT_FALSE(ptp_offset(peer, host_line(from_ns(6'000'000'000))));
}

}  // namespace ptp_offset_test
}  // namespace mocap::cameras
