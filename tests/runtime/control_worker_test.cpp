#include "runtime/control_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace mocap::runtime {
namespace control_worker_test {

using ::testing::HasSubstr;

Description one_subject() {
  Description description;
  description.cameras.resize(1);
  description.cameras[0].name = "north";
  Subject subject;
  subject.name = "anna";
  subject.marker_set.skeleton.bones.resize(2);
  subject.marker_set.markers.resize(3);
  description.subjects.push_back(subject);
  return description;
}

ControlRequest request(ControlAction action, const std::string& name = {}) {
  ControlRequest wanted;
  wanted.action = action;
  wanted.name = name;
  return wanted;
}

// A server that returns the given requests one after the other, then stops the worker.
class Script final : public ControlServer {
 public:
  Script(std::vector<ControlRequest> requests, std::vector<ControlAnswer>& answers, std::stop_source& end)
      : requests_(std::move(requests)), answers_(answers), end_(end) {}
  std::optional<ControlRequest> next(Duration) override {
    if (asked_ == requests_.size()) {
      end_.request_stop();
      return std::nullopt;
    }
    return requests_[asked_++];
  }
  void answer(const ControlAnswer& answer) override { answers_.push_back(answer); }

 private:
  std::vector<ControlRequest> requests_;
  std::vector<ControlAnswer>& answers_;
  std::stop_source& end_;
  std::size_t asked_ = 0;
};

struct World {
  WakeSignal fusion;
  ControlChannel control;
  CameraChannel camera{4, fusion};

  World() { control.wake_fusion = &fusion; }

  std::vector<ControlAnswer> ask(std::vector<ControlRequest> requests, bool lossless = false) {
    std::vector<ControlAnswer> answers;
    std::stop_source end;
    ControlWorker worker(std::make_unique<Script>(std::move(requests), answers, end), one_subject(), lossless,
                         {&control, {&camera}});
    worker.run(end.get_token());
    return answers;
  }
};

// Plays the fusion thread and the camera thread: answers each order with success.
std::jthread obliging(World& world) {
  return std::jthread([&world](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      SubjectOrder subject;
      while (world.control.to_fusion.try_pop(subject)) {
        static_cast<void>(world.control.from_fusion.try_push({subject.number, true, false, {}}));
      }
      CameraOrder camera;
      while (world.camera.orders.try_pop(camera)) {
        static_cast<void>(world.camera.orders_done.try_push({camera.number, true, false, {}}));
      }
      std::this_thread::yield();
    }
  });
}

TEST(ControlWorker, RejectsUnknownNamesAndListsTheKnownOnes) {
  World world;

  const auto answers =
      world.ask({request(ControlAction::ResetSubject, "ben"), request(ControlAction::AdjustCamera, "south")});

  EXPECT_EQ(answers[0].code, ControlCode::NotFound);
  EXPECT_THAT(answers[0].message, HasSubstr("'ben'; the daemon was configured with: anna"));
  EXPECT_EQ(answers[1].code, ControlCode::NotFound);
  EXPECT_THAT(answers[1].message, HasSubstr("configured with: north"));
}

TEST(ControlWorker, ForwardsANewSubjectToTheMainThread) {
  World world;
  MainOrder order;
  std::jthread main([&](const std::stop_token& stop) {
    while (!stop.stop_requested() && !world.control.to_main.try_pop(order)) std::this_thread::yield();
    static_cast<void>(world.control.from_main.try_push({order.number, true, "changed"}));
  });
  ControlRequest ben = request(ControlAction::AddSubject, "ben"), anna = request(ControlAction::AddSubject, "anna");
  ben.marker_set = anna.marker_set = "/sets/rigid3.toml";

  const auto answers = world.ask({ben, anna});
  main.join();

  EXPECT_EQ(answers[0].message, "changed");
  EXPECT_EQ(order.subject, "ben");
  EXPECT_EQ(order.marker_set, "/sets/rigid3.toml");
  EXPECT_EQ(answers[1].code, ControlCode::Invalid);
  EXPECT_THAT(answers[1].message, HasSubstr("there is a subject 'anna' already"));
}

TEST(ControlWorker, RejectsAFitOfAnotherBody) {
  World world;
  ControlRequest fit = request(ControlAction::FitSubject, "anna");
  fit.rest_offsets_m.resize(2);
  fit.marker_offsets_m.resize(7);

  const auto answers = world.ask({fit});

  EXPECT_EQ(answers[0].code, ControlCode::Invalid);
  EXPECT_THAT(answers[0].message, HasSubstr("has 2 bones and 3 markers, the fit has 2 and 7"));
}

TEST(ControlWorker, ReportsAThreadThatDoesNotAnswer) {
  World world;

  const auto answers = world.ask({request(ControlAction::ResetSubject, "anna")});

  EXPECT_EQ(answers[0].code, ControlCode::Timeout);
}

TEST(ControlWorker, ReportsAbsentSubjectsAndWhetherCamerasRun) {
  World world;
  const auto threads = obliging(world);

  const auto answers = world.ask({request(ControlAction::RemoveSubject, "anna"), request(ControlAction::StopCapture),
                                  request(ControlAction::GetStatus), request(ControlAction::AddSubject, "anna"),
                                  request(ControlAction::StartCapture), request(ControlAction::GetStatus)});

  EXPECT_TRUE(answers[2].status->subjects[0].away);
  EXPECT_FALSE(answers[2].status->capturing);
  EXPECT_FALSE(answers[5].status->subjects[0].away);
  EXPECT_TRUE(answers[5].status->capturing);
}

TEST(ControlWorker, DoesNotStopAReplay) {
  World world;

  const auto answers = world.ask({request(ControlAction::StopCapture)}, true);

  EXPECT_EQ(answers[0].code, ControlCode::Unsupported);
}

TEST(ControlWorker, ExecutesNoRequestBetweenItsAnswerAndTheChange) {
  World world;
  std::jthread main([&world](const std::stop_token& stop) {
    MainOrder order;
    while (!stop.stop_requested() && !world.control.to_main.try_pop(order)) std::this_thread::yield();
    static_cast<void>(world.control.from_main.try_push({order.number, true, "changed", true}));
  });

  const auto answers = world.ask({request(ControlAction::Reload), request(ControlAction::GetStatus)});

  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].code, ControlCode::Done);
  EXPECT_EQ(answers[0].message, "changed");
}

}  // namespace control_worker_test
}  // namespace mocap::runtime
