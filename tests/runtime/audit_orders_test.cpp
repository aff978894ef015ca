#include "runtime/control/audit_orders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::runtime {
namespace audit_orders_test {

using ::testing::Contains;
using ::testing::Pair;

TEST(AuditOrders, HaveTheWordsOfTheCommandItsValuesAndItsOutcome) {
  ControlRequest camera;
  camera.action = ControlAction::AdjustCamera;
  camera.name = "north";
  camera.exposure_us = 700.0;
  camera.by.name = "anna";
  ControlAnswer answer;
  answer.message = "exposure_us 500 -> 700";

  const AuditEntry entry = entry_of(camera, answer);

  EXPECT_EQ(entry.what, "ordered");
  EXPECT_EQ(entry.who.name, "anna");
  EXPECT_THAT(entry.details, Contains(Pair("order", "camera set")));
  EXPECT_THAT(entry.details, Contains(Pair("name", "north")));
  EXPECT_THAT(entry.details, Contains(Pair("exposure_us", "700")));
  EXPECT_THAT(entry.details, Contains(Pair("outcome", "done")));
  EXPECT_THAT(entry.details, Contains(Pair("answer", "exposure_us 500 -> 700")));
}

TEST(AuditOrders, AreNamedForEveryActionThatChangesSomething) {
  for (int action = 0; action <= static_cast<int>(ControlAction::Calibrate); ++action) {
    ControlRequest request;
    request.action = static_cast<ControlAction>(action);
    const AuditEntry entry = entry_of(request, {});
    EXPECT_EQ(entry.details.front().second == "read", only_looks(request.action)) << action;
  }
}

TEST(AuditOrders, TellHowATakeEnded) {
  TakeHealth take;
  take.state = TakeState::Ended;
  take.seconds = 2.5;
  take.size_bytes = 4096;
  const AuditEntry ended = entry_of(take, {.name = "ben"});
  take.state = TakeState::Cancelled;
  const AuditEntry cancelled = entry_of(take, {});

  EXPECT_EQ(ended.what, "retained");
  EXPECT_EQ(ended.who.name, "ben");
  EXPECT_THAT(ended.details, Contains(Pair("seconds", "2.50")));
  EXPECT_THAT(ended.details, Contains(Pair("size_bytes", "4096")));
  EXPECT_EQ(cancelled.what, "discarded");
}

}  // namespace audit_orders_test
}  // namespace mocap::runtime
