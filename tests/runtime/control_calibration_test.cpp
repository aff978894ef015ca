// The orders to the calibration thread, whose side the test plays.
#include <gmock/gmock.h>

#include <functional>
#include <memory>
#include <vector>

#include "runtime/control/control_worker.h"

namespace mocap::runtime {
namespace control_calibration_test {

using ::testing::HasSubstr;

struct Told {
  ControlCode code = ControlCode::Done;
  std::string message;
  CalibrationReport calibration;
};

// Sends orders one after the other; before each, `meanwhile` plays the calibration thread.
class Operator final : public ControlServer {
 public:
  Operator(std::vector<CalibrationAction> orders, std::function<void()> meanwhile, std::vector<Told>& told,
           std::stop_source& end)
      : orders_(std::move(orders)), meanwhile_(std::move(meanwhile)), told_(told), end_(end) {}

  std::optional<ControlRequest> next(Duration) override {
    if (asked_ == orders_.size()) {
      end_.request_stop();
      return std::nullopt;
    }
    if (meanwhile_) meanwhile_();
    ControlRequest request;
    request.calibration.action = orders_[asked_++];
    const bool looks = request.calibration.action == CalibrationAction::Look;
    request.action = looks ? ControlAction::GetCalibration : ControlAction::Calibrate;
    return request;
  }
  void answer(std::uint64_t, const ControlAnswer& answer) override {
    told_.push_back(
        {answer.code, answer.message, answer.calibration != nullptr ? *answer.calibration : CalibrationReport{}});
  }

 private:
  std::vector<CalibrationAction> orders_;
  std::function<void()> meanwhile_;
  std::vector<Told>& told_;
  std::stop_source& end_;
  std::size_t asked_ = 0;
};

struct Desk {
  WakeSignal fusion;
  ControlChannel control;
  CameraChannel camera{4, fusion};
  CalibrationChannel calibration;

  Desk() { control.wake_fusion = &fusion; }

  std::vector<Told> order(std::vector<CalibrationAction> orders, std::function<void()> meanwhile = {}) {
    std::vector<Told> told;
    std::stop_source end;
    ControlWorker worker(std::make_unique<Operator>(std::move(orders), std::move(meanwhile), told, end), {}, false,
                         {&control, {&camera}, nullptr, &calibration});
    worker.run(end.get_token());
    return told;
  }

  void report(std::uint64_t order, CalibrationState state) {
    CalibrationReport report;
    report.order = order;
    report.state = state;
    static_cast<void>(calibration.reports.try_push(std::move(report)));
  }
};

using enum CalibrationAction;

TEST(ControlCalibration, IsAnsweredBeforeTheCalibrationThreadFollows) {
  Desk desk;

  const auto told = desk.order({Floor, Look});

  EXPECT_EQ(told[0].code, ControlCode::Done);
  EXPECT_EQ(told[1].calibration.state, CalibrationState::Collecting);
  EXPECT_TRUE(told[1].calibration.is_floor);
  CalibrationOrder sent;
  ASSERT_TRUE(desk.calibration.orders.try_pop(sent));
  EXPECT_EQ(sent.action, Floor);
}

TEST(ControlCalibration, PassesOverReportsFromBeforeTheOrder) {
  Desk desk;
  int looks = 0;

  const auto told = desk.order({Wand, Look, Look}, [&] {
    if (++looks == 2) desk.report(0, CalibrationState::Solved);
    if (looks == 3) desk.report(1, CalibrationState::Failed);
  });

  EXPECT_EQ(told[1].calibration.state, CalibrationState::Collecting);
  EXPECT_EQ(told[2].calibration.state, CalibrationState::Failed);
}

TEST(ControlCalibration, SolvesOnlyWhatIsCollected) {
  Desk desk;

  const auto told = desk.order({Solve, Wand, Solve, Wand, Cancel, Look});

  EXPECT_EQ(told[0].code, ControlCode::Invalid);
  EXPECT_THAT(told[0].message, HasSubstr("nothing is collected"));
  EXPECT_EQ(told[2].calibration.state, CalibrationState::Solving);
  EXPECT_EQ(told[3].code, ControlCode::Failed) << "a solution is in progress";
  EXPECT_TRUE(desk.calibration.cancelled.load());
  EXPECT_EQ(told[5].calibration.state, CalibrationState::Cancelled);
}

TEST(ControlCalibration, RefusesOrdersThatWaitForTooLong) {
  Desk desk;

  const auto told = desk.order({Wand, Floor, Wand, Floor, Wand, Look});

  EXPECT_EQ(told[4].code, ControlCode::Timeout);
  EXPECT_TRUE(told[5].calibration.is_floor) << "the last order that was passed on";
}

}  // namespace control_calibration_test
}  // namespace mocap::runtime
