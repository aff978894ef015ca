#include "web/worker.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace mocap::web {
namespace worker_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

TEST(Worker, ExecutesFunctionsInTheirOrder) {
  Worker worker;
  std::vector<int> order;
  std::promise<void> done;

  for (int i = 0; i < 3; ++i) ASSERT_TRUE(worker.run([&order, i] { order.push_back(i); }));
  ASSERT_TRUE(worker.run([&] { done.set_value(); }));

  ASSERT_EQ(done.get_future().wait_for(kLong), std::future_status::ready);
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
}

TEST(Worker, RefusesMoreThanSixteenFunctionsThatWait) {
  std::promise<void> begun, end;
  Worker worker;
  ASSERT_TRUE(worker.run([&] {
    begun.set_value();
    end.get_future().wait();
  }));
  ASSERT_EQ(begun.get_future().wait_for(kLong), std::future_status::ready);

  int queued = 0;
  while (queued < 100 && worker.run([] {})) ++queued;

  EXPECT_EQ(queued, 16);
  EXPECT_TRUE(worker.is_busy());
  end.set_value();
}

}  // namespace worker_test
}  // namespace mocap::web
