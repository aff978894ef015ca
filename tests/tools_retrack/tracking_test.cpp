#include "lib/retrack/tracking.h"

#include <gmock/gmock.h>

#include "lib/retrack/recorded_sets.h"
#include "tools_retrack/recorded_world.h"

namespace mocap::retrack {
namespace tracking_test {

using ::testing::HasSubstr;

// Notes which sets come.
class NotedSets : public SetTracker {
 public:
  Result<const Snapshot*> step(const FrameSet& set) override {
    numbers.push_back(set.number);
    views.push_back(set.views.size());
    return nullptr;
  }
  const std::optional<SubjectFit>& fit() const override { return none_; }

  std::vector<std::uint64_t> numbers;
  std::vector<std::size_t> views;

 private:
  const std::optional<SubjectFit> none_;
};

class TrackingOfATake : public testing::Test {
 protected:
  TrackingOfATake() : take_(*take::TakeReader::open(world_.record("walk", {.sets = 120}))) {}

  Tracking tracking(const Span& part) {
    const std::vector<CameraId> ids{CameraId{0}, CameraId{1}, CameraId{2}, CameraId{3}};
    return {take_, world_.settings(), ids, std::make_unique<RecordedSets>(ids, 4), part, sets_, nullptr};
  }

  static Timestamp at_set(int set) { return RecordedWorld::kStart + from_s(set / RecordedWorld::kRate_hz); }

  RecordedWorld world_;
  take::TakeReader take_;
  NotedSets sets_;
};

TEST_F(TrackingOfATake, TracksTheSetsOfItsPartWithAllTheirImages) {
  std::vector<double> shares;
  const auto go_on = [&](const RetrackProgress& progress) {
    shares.push_back(progress.share);
    return true;
  };

  ASSERT_TRUE(tracking({at_set(5), at_set(110)}).run(go_on));

  ASSERT_EQ(sets_.numbers.size(), 105U);
  EXPECT_EQ(sets_.numbers.front(), 5U);
  EXPECT_EQ(sets_.numbers.back(), 109U);
  EXPECT_THAT(sets_.views, testing::Each(4U));
  ASSERT_EQ(shares.size(), 1U);
  EXPECT_NEAR(shares.front(), 99.0 / 105.0, 0.01) << "of the part";
}

TEST_F(TrackingOfATake, EndsWhenItIsTold) {
  const Status ended = tracking({}).run([](const RetrackProgress&) { return false; });

  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, ErrorCode::EndOfStream);
  EXPECT_EQ(sets_.numbers.size(), 100U);
}

}  // namespace tracking_test
}  // namespace mocap::retrack
