#include "wire/forward_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "wire/zmq_control.h"

namespace mocap::wire {
namespace forward_request_test {

using ::testing::HasSubstr;

TEST(ControlOfNode, IsReachedAtTheAddressOfTheNode) {
  EXPECT_EQ(*control_of_node("tcp://*:5571", "tcp://10.0.0.7:5575"), "tcp://10.0.0.7:5571");
  EXPECT_EQ(*control_of_node("tcp://0.0.0.0:5571", "tcp://127.0.0.1:5575"), "tcp://127.0.0.1:5571");
  EXPECT_EQ(*control_of_node("tcp://10.0.0.7:5571", "tcp://10.0.0.7:5575"), "tcp://10.0.0.7:5571");
  EXPECT_EQ(*control_of_node("tcp://127.0.0.1:5571", "tcp://127.0.0.1:5575"), "tcp://127.0.0.1:5571");
}

TEST(ControlOfNode, IsNotThereIfTheNodeHasNoneOrKeepsItToItself) {
  EXPECT_EQ(control_of_node("", "tcp://10.0.0.7:5575").error().code, ErrorCode::Unsupported);
  const auto local = control_of_node("tcp://127.0.0.1:5571", "tcp://10.0.0.7:5575");
  ASSERT_FALSE(local);
  EXPECT_THAT(local.error().message, HasSubstr("set [control] endpoint of the node"));
}

TEST(ForwardRequest, GivesTheDaemonsAnswer) {
  ControlSettings settings;
  settings.endpoint = "tcp://127.0.0.1:*";
  auto control = std::move(*ZmqControl::open(settings));
  const std::jthread daemon([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto request = control->next(std::chrono::milliseconds(5));
      if (!request) continue;
      ControlAnswer answer;
      answer.code = request->name == "north" ? ControlCode::Done : ControlCode::Unsupported;
      answer.message = "exposure of " + request->name;
      control->answer(request->number, answer);
    }
  });
  ControlRequest request;
  request.action = ControlAction::AdjustCamera;
  request.exposure_us = 500.0;

  request.name = "north";
  const Status done = forward_request(control->endpoint(), {}, request, std::chrono::seconds(20));
  EXPECT_TRUE(done) << done.error().message;
  request.name = "south";
  const Status refused = forward_request(control->endpoint(), {}, request, std::chrono::seconds(20));

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(refused.error().message, "exposure of south");
}

}  // namespace forward_request_test
}  // namespace mocap::wire
