#include "web/preflight_site.h"

#include <gmock/gmock.h>

#include <deque>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>

#include "wire/zmq_control.h"

namespace mocap::web {
namespace preflight_site_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

TEST(PreflightSite, SaysThatTheDaemonDoesNotAnswerToAllWhoAsked) {
  std::promise<std::function<void()>> ended;
  const auto site = *PreflightSite::open({.endpoint = "tcp://127.0.0.1:1"},
                                         [&](std::function<void()> work) { ended.set_value(std::move(work)); });
  std::vector<std::string> came;
  for (int i = 0; i < 2; ++i) site->answer({}, [&](const HttpReply& reply) { came.push_back(reply.body); });

  auto end = ended.get_future();
  ASSERT_EQ(end.wait_for(kLong), std::future_status::ready);
  end.get()();

  ASSERT_EQ(came.size(), 2U);
  EXPECT_EQ(came[0], came[1]);
  const auto findings = nlohmann::json::parse(came[0]);
  EXPECT_EQ(findings[0]["verdict"], "bad");
  EXPECT_EQ(findings[0]["cure"], "systemctl status mocapd");
}

TEST(PreflightSite, RefusesAMalformedEndpoint) {
  EXPECT_FALSE(PreflightSite::open({.endpoint = "nonsense"}, [](const std::function<void()>&) {}));
}

}  // namespace preflight_site_test
}  // namespace mocap::web
