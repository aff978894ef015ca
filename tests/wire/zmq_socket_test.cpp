#include "wire/zmq_socket.h"

#include <gtest/gtest.h>

#include <chrono>

namespace mocap::wire {
namespace zmq_socket_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(WholeMs, RoundsATimeUpAndNeverWaitsWithoutEnd) {
  EXPECT_EQ(whole_ms(microseconds(1)), 1);
  EXPECT_EQ(whole_ms(milliseconds(50)), 50);
  EXPECT_EQ(whole_ms(Duration::zero()), 0);
  EXPECT_EQ(whole_ms(milliseconds(-1)), 0);
  EXPECT_EQ(whole_ms(Duration::min()), 0);
}

}  // namespace zmq_socket_test
}  // namespace mocap::wire
