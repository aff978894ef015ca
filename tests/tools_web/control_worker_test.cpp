#include "web/control_worker.h"

#include <gmock/gmock.h>

#include <future>

#include "mocap/v1/control.pb.h"
#include "wire/zmq_control.h"

namespace mocap::web {
namespace control_worker_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

std::unique_ptr<ControlWorker> worker_at(const std::string& endpoint) {
  auto opened = ControlWorker::open({.endpoint = endpoint});
  EXPECT_TRUE(opened) << opened.error().message;
  return *std::move(opened);
}

TEST(ControlWorker, BringsTheDaemonsAnswer) {
  const auto control = *wire::ZmqControl::open({.endpoint = "tcp://127.0.0.1:*"});
  const auto worker = worker_at(control->endpoint());
  std::promise<Result<std::string>> came;
  v1::Request request;
  request.set_id(5);
  request.mutable_status();

  ASSERT_TRUE(worker->ask(request.SerializeAsString(), kLong,
                          [&](Result<std::string> answer) { came.set_value(std::move(answer)); }));
  const auto received = control->next(kLong);
  ASSERT_TRUE(received);
  control->answer(received->number, {});

  auto future = came.get_future();
  ASSERT_EQ(future.wait_for(kLong), std::future_status::ready);
  const auto result = future.get();
  ASSERT_TRUE(result) << result.error().message;
  v1::Answer message;
  ASSERT_TRUE(message.ParseFromString(*result));
  EXPECT_EQ(message.id(), 5U);
}

TEST(ControlWorker, SaysWhyNoAnswerCame) {
  const auto worker = worker_at("tcp://127.0.0.1:1");
  std::promise<Result<std::string>> came;

  ASSERT_TRUE(worker->ask("x", kLong, [&](Result<std::string> answer) { came.set_value(std::move(answer)); }));

  auto future = came.get_future();
  ASSERT_EQ(future.wait_for(kLong), std::future_status::ready);
  EXPECT_THAT(future.get().error().message, testing::HasSubstr("tcp://127.0.0.1:1"));
}

TEST(ControlWorker, RefusesMoreThanSixteenWaitingRequests) {
  const auto control = *wire::ZmqControl::open({.endpoint = "tcp://127.0.0.1:*"});  // never answers
  const auto worker = worker_at(control->endpoint());

  int queued = 0;
  while (queued < 100 && worker->ask("x", std::chrono::seconds(2), [](const Result<std::string>&) {})) ++queued;

  EXPECT_GE(queued, 16);
  EXPECT_LE(queued, 17);  // one may be sent already
}

}  // namespace control_worker_test
}  // namespace mocap::web
