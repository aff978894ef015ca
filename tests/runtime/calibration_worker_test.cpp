#include "runtime/calibration_worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace mocap::runtime {
namespace calibration_worker_test {

constexpr Duration kLimit = std::chrono::seconds(60);

// Counts images; a solution goes on until it is cancelled.
class EndlessCalibrator : public RigCalibrator {
 public:
  explicit EndlessCalibrator(std::atomic<int>& images) : images_(images) {}
  Status start(const CalibrationOrder& order) override {
    if (order.action == CalibrationAction::Wand && order.wand_m.empty())
      return Error{ErrorCode::InvalidArgument, "no wand"};
    report_.state = CalibrationState::Collecting;
    return {};
  }
  bool add(std::size_t /*camera*/, const CalibrationImage& /*image*/) override { return ++images_ < 1000; }
  bool add(const CalibrationMarkers& markers) override { return markers.markers.empty(); }
  void solve(const CalibrationProgress& progress) override {
    while (progress("adjusting", 0.5)) std::this_thread::yield();
    report_.state = CalibrationState::Cancelled;
  }
  CalibrationReport report() const override { return report_; }

 private:
  std::atomic<int>& images_;
  CalibrationReport report_;
};

class CalibrationWorkerTest : public testing::Test {
 protected:
  CalibrationWorkerTest()
      : worker_(std::make_unique<EndlessCalibrator>(images_), {&camera_}, channel_),
        thread_([this](const std::stop_token& stop) { worker_.run(stop); }) {}

  // Waits for the next report in a state.
  bool reaches(CalibrationState state) {
    return until([&] {
      while (channel_.reports.try_pop(report_)) {
        if (report_.state == state) return true;
      }
      return false;
    });
  }

  // Returns the state after the order.
  CalibrationState order(CalibrationAction action, std::vector<double> wand_m = {}) {
    CalibrationOrder order;
    order.number = ++orders_;
    order.action = action;
    order.wand_m = std::move(wand_m);
    EXPECT_TRUE(channel_.orders.try_push(order));
    channel_.ordered.signal();
    EXPECT_TRUE(until([&] { return channel_.reports.try_pop(report_) && report_.order == orders_; }));
    return report_.state;
  }

  template <class Holds>
  bool until(const Holds& holds) {
    const Timestamp begun = host_now();
    while (!holds()) {
      if (host_now() - begun > kLimit) return false;
      std::this_thread::yield();
    }
    return true;
  }

  std::atomic<int> images_{0};
  WakeSignal fusion_;
  CameraChannel camera_{4, fusion_};
  CalibrationChannel channel_;
  std::uint64_t orders_ = 0;
  CalibrationReport report_;
  CalibrationWorker worker_;
  std::jthread thread_;
};

TEST_F(CalibrationWorkerTest, TakesImagesOnlyWhileItCollects) {
  EXPECT_FALSE(camera_.calibrating.load());
  EXPECT_EQ(order(CalibrationAction::Wand), CalibrationState::Failed)
      << "the calibrator refuses an order without a wand";
  EXPECT_EQ(report_.message, "no wand");
  EXPECT_FALSE(camera_.calibrating.load());

  ASSERT_EQ(order(CalibrationAction::Wand, {0.0, 0.5}), CalibrationState::Collecting);
  EXPECT_TRUE(camera_.calibrating.load());
  ASSERT_TRUE(camera_.to_calibrate.try_push({}));
  EXPECT_TRUE(until([&] { return images_ == 1; }));

  EXPECT_EQ(order(CalibrationAction::Cancel), CalibrationState::Cancelled);
  EXPECT_FALSE(camera_.calibrating.load());
}

TEST_F(CalibrationWorkerTest, SolvesOnlyWhatWasCollectedAndEndsASolutionThatIsCancelled) {
  EXPECT_EQ(order(CalibrationAction::Solve), CalibrationState::Idle) << "nothing was collected";
  ASSERT_EQ(order(CalibrationAction::Wand, {0.0, 0.5}), CalibrationState::Collecting);

  EXPECT_EQ(order(CalibrationAction::Solve), CalibrationState::Solving);
  channel_.cancelled.store(true);

  EXPECT_TRUE(reaches(CalibrationState::Cancelled));
}

TEST_F(CalibrationWorkerTest, MeasuresTheFloorWithoutAFurtherOrderWhenTheMarkersSuffice) {
  ASSERT_EQ(order(CalibrationAction::Floor), CalibrationState::Collecting);
  EXPECT_TRUE(channel_.markers.wanted.load());
  EXPECT_FALSE(camera_.calibrating.load());
  ASSERT_TRUE(channel_.markers.markers.try_push({}));
  EXPECT_TRUE(reaches(CalibrationState::Collecting));

  CalibrationMarkers last;
  static_cast<void>(last.markers.try_push_back({}));
  ASSERT_TRUE(channel_.markers.markers.try_push(last));

  EXPECT_TRUE(reaches(CalibrationState::Solving));
  EXPECT_FALSE(channel_.markers.wanted.load());
  channel_.cancelled.store(true);
}

TEST_F(CalibrationWorkerTest, EndsWhileItSolves) {
  ASSERT_EQ(order(CalibrationAction::Wand, {0.0, 0.5}), CalibrationState::Collecting);
  ASSERT_EQ(order(CalibrationAction::Solve), CalibrationState::Solving);

  thread_.request_stop();
  thread_.join();

  EXPECT_FALSE(camera_.calibrating.load());
}

}  // namespace calibration_worker_test
}  // namespace mocap::runtime
