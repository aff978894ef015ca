#include "bench/bridges/arrivals.h"

#include <gtest/gtest.h>

namespace arrivals_test {

using mocap::bench::AddedFigures;
using mocap::bench::Arrivals;
using mocap::bench::compare;

TEST(Arrivals, TheTimeBetweenSubscriberAndReceiverIsAdded) {
  Arrivals subscriber(1, 10), receivers(2, 10);
  for (std::uint64_t frame = 2; frame <= 4; ++frame) {
    const auto at_ns = static_cast<std::int64_t>(frame) * 1'000'000;
    subscriber.note(0, frame, at_ns);
    receivers.note(0, frame, at_ns + 100'000);
    receivers.note(1, frame, at_ns + 300'000);
  }

  const AddedFigures figures = compare(subscriber, receivers, {2, 4});

  EXPECT_DOUBLE_EQ(figures.p50_us, 100.0);
  EXPECT_DOUBLE_EQ(figures.max_us, 300.0);
  EXPECT_EQ(figures.frames, 6U);
  EXPECT_EQ(figures.lost, 0U);
}

TEST(Arrivals, TheLastPacketOfAFrameCounts) {
  Arrivals subscriber(1, 10), receivers(1, 10);
  subscriber.note(0, 5, 1'000'000);
  receivers.note(0, 5, 1'200'000);
  receivers.note(0, 5, 1'500'000);

  EXPECT_DOUBLE_EQ(compare(subscriber, receivers, {5, 5}).max_us, 500.0);
}

TEST(Arrivals, AFrameThatAReceiverNeverGotIsLost) {
  Arrivals subscriber(1, 10), receivers(2, 10);
  for (const std::uint64_t frame : {3, 4}) subscriber.note(0, frame, 1'000'000);
  receivers.note(0, 3, 1'100'000);
  receivers.note(1, 3, 1'100'000);
  receivers.note(1, 4, 1'100'000);
  receivers.note(0, 9, 1'100'000);   // out of the range
  receivers.note(0, 10, 1'100'000);  // out of the table

  const AddedFigures figures = compare(subscriber, receivers, {3, 4});

  EXPECT_EQ(figures.lost, 1U);
  EXPECT_EQ(figures.frames, 3U);
}

TEST(Arrivals, AFrameThatOnlyTheReceiverGotHasNoAddedTime) {
  Arrivals subscriber(1, 10), receivers(1, 10);
  receivers.note(0, 3, 1'100'000);

  const AddedFigures figures = compare(subscriber, receivers, {3, 3});

  EXPECT_EQ(figures.frames, 1U);
  EXPECT_EQ(figures.p99_us, 0.0);
}

}  // namespace arrivals_test
