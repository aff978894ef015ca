#include "cameras/clock/peer_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

namespace mocap::cameras {
namespace peer_clock_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// A peer whose clock is ahead and fast, and a network with exponential delays over a minimum.
struct Peer {
  Duration ahead = milliseconds(20);
  double drift = 50e-6;
  double least_s = 100e-6;
  double jitter_s = 200e-6;
  std::mt19937_64 random{5};

  Timestamp clock(Timestamp host) const {
    const Duration age = host - from_ns(1'000'000'000'000);
    return host + ahead + from_s(drift * to_s(age));
  }
  Duration delay() { return from_s(least_s + std::exponential_distribution<>(1.0 / jitter_s)(random)); }
  Echo echo(Timestamp called_at) {
    const Timestamp received = called_at + delay();
    const Timestamp sent = received + microseconds(30);
    return {called_at, clock(received), clock(sent), sent + delay()};
  }
  static Timestamp call(int k) { return from_ns(1'000'000'000'000) + milliseconds(100) * k; }
};

double error_us(const PeerClock& clock, const Peer& peer, Timestamp at) {
  return to_us(clock.to_host(peer.clock(at)) - at);
}

TEST(PeerClock, IsWithinAHundredMicrosecondsAfterTenSeconds) {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t run = 0; run < 20; ++run) {
    Peer peer{.random = std::mt19937_64(run)};
    PeerClock clock;
    for (int k = 0; k < 300; ++k) {
      clock.add(peer.echo(Peer::call(k)));
      if (k < 100) continue;
      const double error = error_us(clock, peer, Peer::call(k) + milliseconds(50));
      sum += error * error;
      ++count;
    }
    EXPECT_NEAR(clock.drift(), -50e-6, 20e-6);
  }
  const double rms_us = std::sqrt(sum / count);
  RecordProperty("rms_us", std::to_string(rms_us));
  EXPECT_LT(rms_us, 100.0);
}

TEST(PeerClock, StatesItsErrorHonestly) {
  for (const double jitter_s : {50e-6, 500e-6, 2e-3}) {
    double error_square = 0.0, stated_square = 0.0;
    for (std::uint64_t run = 0; run < 60; ++run) {
      Peer peer{.jitter_s = jitter_s, .random = std::mt19937_64(100 + run)};
      PeerClock clock;
      for (int k = 0; k < 250; ++k) {
        clock.add(peer.echo(Peer::call(k)));
        if (k < 100) continue;
        const Timestamp at = Peer::call(k) + milliseconds(50);
        error_square += std::pow(error_us(clock, peer, at), 2);
        stated_square += std::pow(to_us(clock.uncertainty(at)), 2);
      }
    }
    const double ratio = std::sqrt(error_square / stated_square);
    RecordProperty("ratio", std::to_string(ratio));
    EXPECT_GT(ratio, 0.5) << jitter_s;
    EXPECT_LT(ratio, 1.5) << jitter_s;
  }
}

TEST(PeerClock, BoundsItsErrorByTheRoundTripFromTheFirstEchoOn) {
  Peer peer{.least_s = 3e-3};
  PeerClock clock;
  EXPECT_FALSE(clock.known());

  clock.add(peer.echo(Peer::call(0)));

  ASSERT_TRUE(clock.known());
  EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(0))), 0.5 * to_us(clock.round_trip()));
  EXPECT_GT(to_us(clock.uncertainty(Peer::call(0))), 1000.0);  // 6 ms of round trip: does not fit a window of 0.5 ms
}

TEST(PeerClock, GrowsUncertainWithoutEchoes) {
  Peer peer;
  PeerClock clock;
  for (int k = 0; k < 100; ++k) clock.add(peer.echo(Peer::call(k)));

  EXPECT_GT(clock.uncertainty(Peer::call(1100)), clock.uncertainty(Peer::call(100)) + microseconds(100));
}

TEST(PeerClock, FollowsAPeerWhoseClockJumps) {
  Peer peer;
  PeerClock clock;
  for (int k = 0; k < 200; ++k) clock.add(peer.echo(Peer::call(k)));
  peer.ahead += milliseconds(50);
  for (int k = 200; k < 300; ++k) clock.add(peer.echo(Peer::call(k)));

  EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(300))), 500.0);
}

// Echoes of several connections arrive in any order.
TEST(PeerClock, LeavesOutAnEchoThatWasOvertaken) {
  Peer peer;
  PeerClock clock;
  for (int k = 0; k < 100; ++k) clock.add(peer.echo(Peer::call(k)));
  const Duration before = clock.uncertainty(Peer::call(100));

  EXPECT_FALSE(clock.add(peer.echo(Peer::call(98))));

  EXPECT_EQ(clock.uncertainty(Peer::call(100)), before);
  EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(100))), 200.0);
}

// The processors of the peer are busy: most echoes are late by milliseconds.
TEST(PeerClock, IsAsCertainAsItsBestEchoAllows) {
  for (std::uint64_t run = 0; run < 20; ++run) {
    Peer peer{.jitter_s = 20e-3, .random = std::mt19937_64(run)};
    PeerClock clock;
    for (int k = 0; k < 40; ++k) {
      peer.jitter_s = k % 20 == 5 ? 50e-6 : 20e-3;
      clock.add(peer.echo(Peer::call(k)));
      if (k < 6) continue;
      EXPECT_LT(to_us(clock.uncertainty(Peer::call(k))), 400.0);
      EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(k))), 700.0);
    }
  }
}

// The peer's line by PTP at the instant of an echo, wrong by `error`.
MeasuredLine by_ptp(const Peer& peer, const Echo& echo, Duration error, Duration uncertainty) {
  const Timestamp origin = from_ns(1'000'000'000'000);
  const Timestamp host = origin + from_s(to_s(echo.sent_at - peer.ahead - origin) / (1.0 + peer.drift));
  return {{echo.sent_at, host + error - echo.sent_at, -peer.drift}, uncertainty};
}

TEST(PeerClock, UsesALineThatIsMoreCertainThanTheEchoes) {
  Peer peer{.jitter_s = 2e-3};
  PeerClock clock;
  for (int k = 0; k < 50; ++k) {
    const Echo echo = peer.echo(Peer::call(k));
    ASSERT_TRUE(clock.add(echo, by_ptp(peer, echo, Duration{}, std::chrono::nanoseconds(400))));
    EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(k) + milliseconds(50))), 0.1);
  }
  EXPECT_EQ(clock.source(), PeerLineSource::Measured);
  EXPECT_LT(clock.uncertainty(Peer::call(49)), microseconds(1));
}

TEST(PeerClock, DoesNotBelieveALineOutsideOfWhatTheEchoesBound) {
  for (const Duration error :
       {Duration(milliseconds(5)), Duration(-milliseconds(5)), Duration(std::chrono::seconds(37))}) {
    Peer peer;
    PeerClock clock;
    for (int k = 0; k < 100; ++k) {
      const Echo echo = peer.echo(Peer::call(k));
      ASSERT_TRUE(clock.add(echo, by_ptp(peer, echo, error, std::chrono::nanoseconds(400))));
      EXPECT_EQ(clock.source(), PeerLineSource::Contradicted);
    }
    EXPECT_LT(std::abs(error_us(clock, peer, Peer::call(100))), 200.0);
    EXPECT_GT(clock.uncertainty(Peer::call(100)), microseconds(1));
  }
}

TEST(PeerClock, KeepsTheEchoesIfTheyAreMoreCertain) {
  Peer peer;
  PeerClock clock;
  for (int k = 0; k < 100; ++k) {
    const Echo echo = peer.echo(Peer::call(k));
    clock.add(echo, by_ptp(peer, echo, Duration{}, milliseconds(5)));
  }

  EXPECT_EQ(clock.source(), PeerLineSource::Echoes);
}

TEST(PeerClock, LeavesOutAnEchoWhoseInstantsContradictEachOther) {
  Peer peer;
  PeerClock clock;
  Echo echo = peer.echo(Peer::call(0));
  echo.arrived_at = echo.called_at - microseconds(1);

  clock.add(echo);

  EXPECT_FALSE(clock.known());
}

}  // namespace peer_clock_test
}  // namespace mocap::cameras
