#include "web/site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>

#include "support/temporary_folder.h"
#include "wire/zmq_control.h"

namespace mocap::web {
namespace site_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

const RunHere kAtOnce = [](const std::function<void()>& work) { work(); };

// A site in front of the control socket of a daemon, whose part the test has.
class SiteTest : public testing::Test {
 protected:
  std::unique_ptr<ControlWorker> worker() { return *ControlWorker::open({.endpoint = control_->endpoint()}); }

  std::future<std::string> ask(const std::string& method, const std::string& params) {
    auto said = std::make_shared<std::promise<std::string>>();
    site_.answer(RequestMessage{.id = 1, .method = method, .params = params}, {wire::Role::Operator, "anna"}, "here",
                 [said](std::string text) { said->set_value(std::move(text)); });
    return said->get_future();
  }

  HttpReply answer_to(const std::string& method, const std::string& path) {
    HttpRequest request;
    request.method = method;
    request.path = path;
    request.host = "localhost";
    std::promise<HttpReply> came;
    site_.answer(request, [&](HttpReply reply) { came.set_value(std::move(reply)); });
    auto reply = came.get_future();
    EXPECT_EQ(reply.wait_for(kLong), std::future_status::ready);
    return reply.get();
  }

  std::unique_ptr<wire::ZmqControl> control_ = *wire::ZmqControl::open({.endpoint = "tcp://127.0.0.1:*"});
  Hub hub_{"tcp://127.0.0.1:5570", host_now()};
  std::unique_ptr<ControlWorker> reads_ = worker(), changes_ = worker(), learning_ = worker();
  const support::TemporaryFolder folder_;
  TakeSite takes_{folder_.path(), "tcp://127.0.0.1:5570", kAtOnce};
  std::unique_ptr<PreflightSite> preflight_ = *PreflightSite::open({.endpoint = control_->endpoint()}, kAtOnce);
  Worker imports_;
  Site site_{{}, {hub_, *reads_, *changes_, *learning_, takes_, *preflight_, imports_, kAtOnce}};
};

TEST_F(SiteTest, StopsATakeWhileAMaskIsLearnt) {
  auto learnt = ask("mask", R"({"action":"ACTION_LEARN"})");
  const auto learn = control_->next(kLong);
  ASSERT_TRUE(learn);
  ASSERT_EQ(learn->action, ControlAction::LearnMask);

  auto stopped = ask("take", R"({"action":"ACTION_STOP"})");
  const auto stop = control_->next(kLong);
  ASSERT_TRUE(stop);
  ASSERT_EQ(stop->action, ControlAction::Take);
  EXPECT_EQ(learnt.wait_for(std::chrono::seconds(0)), std::future_status::timeout) << "the daemon still learns";
  control_->answer(stop->number, {});
  EXPECT_EQ(stopped.wait_for(kLong), std::future_status::ready);

  control_->answer(learn->number, {});
  EXPECT_EQ(learnt.wait_for(kLong), std::future_status::ready);
}

TEST_F(SiteTest, LogsTheDownloadOfATakeAndNotTheQuestionForItsSize) {
  folder_.write("walk.mcap", "bytes");

  testing::internal::CaptureStderr();
  EXPECT_EQ(answer_to("HEAD", "/takes/walk.mcap").status, 200);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::Not(testing::HasSubstr("audit")));

  testing::internal::CaptureStderr();
  EXPECT_EQ(answer_to("GET", "/takes/walk.mcap").status, 200);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::HasSubstr("method=/takes/walk.mcap params= answer=200"));
}

}  // namespace site_test
}  // namespace mocap::web
