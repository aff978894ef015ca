#include "runtime/control/control_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace mocap::runtime {
namespace control_worker_test {

using ::testing::HasSubstr;

Description one_subject() {
  Description description;
  description.cameras.resize(1);
  description.cameras[0].name = "north";
  description.cameras[0].width_px = 640;
  description.cameras[0].height_px = 480;
  description.cameras[0].masks = {{{{1.0, 1.0}}, {{9.0, 1.0}}, {{9.0, 9.0}}}};
  description.cameras[0].learnt_masks = {{{{1.0, 1.0}}, {{9.0, 1.0}}, {{9.0, 9.0}}},
                                         {{{20.0, 1.0}}, {{29.0, 1.0}}, {{29.0, 9.0}}}};
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

// A server that returns the given requests one after the other, and then waits for their answers, at most until
// `until`, and stops the worker.
class Script final : public ControlServer {
 public:
  Script(std::vector<ControlRequest> requests, std::vector<ControlAnswer>& answers, std::stop_source& end,
         Timestamp until)
      : requests_(std::move(requests)), answers_(answers), end_(end), until_(until) {}
  std::optional<ControlRequest> next(Duration) override {
    if (asked_ < requests_.size()) return requests_[asked_++];
    std::this_thread::yield();
    if (answers_.size() == requests_.size() || host_now() > until_) end_.request_stop();
    return std::nullopt;
  }
  void answer(std::uint64_t, const ControlAnswer& answer) override { answers_.push_back(answer); }

 private:
  std::vector<ControlRequest> requests_;
  std::vector<ControlAnswer>& answers_;
  std::stop_source& end_;
  Timestamp until_;
  std::size_t asked_ = 0;
};

struct World {
  WakeSignal fusion;
  ControlChannel control;
  CameraChannel camera{4, fusion};
  TakeChannel takes;

  World() { control.wake_fusion = &fusion; }

  // Stops the worker after the last request, or when all are answered, but then at `until` at the latest.
  std::vector<ControlAnswer> ask(std::vector<ControlRequest> requests, bool lossless = false, Timestamp until = {}) {
    std::vector<ControlAnswer> answers;
    std::stop_source end;
    ControlWorker worker(std::make_unique<Script>(std::move(requests), answers, end, until), one_subject(), lossless,
                         {&control, {&camera}, &takes});
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

// Each other request waits behind it.
TEST(ControlWorker, WaitsOnceForASnapshotThatDoesNotCome) {
  World world;
  const std::vector<ControlRequest> wanted(100, request(ControlAction::GetSnapshot));

  const auto answers = world.ask(wanted, false, host_now() + std::chrono::seconds(60));

  ASSERT_EQ(answers.size(), wanted.size());
  EXPECT_EQ(answers.back().code, ControlCode::Timeout);
}

ControlRequest take_request(TakeAction action) {
  ControlRequest wanted = request(ControlAction::Take);
  wanted.take.action = action;
  return wanted;
}

TakeOrder next_take_order(World& world) {
  TakeOrder order;
  while (!world.takes.orders.try_pop(order)) std::this_thread::yield();
  return order;
}

TEST(ControlWorker, ExecutesOtherRequestsWhileATakeEnds) {
  World world;
  std::jthread recorder([&] {
    const TakeOrder stop = next_take_order(world), start = next_take_order(world);
    EXPECT_LE(stop.at, start.at);
    static_cast<void>(world.takes.done.try_push({stop.number, TakeOutcome::Done, "stopped"}));
    static_cast<void>(world.takes.done.try_push({start.number, TakeOutcome::Invalid, "started"}));
  });

  const auto answers =
      world.ask({take_request(TakeAction::Stop), request(ControlAction::GetStatus), take_request(TakeAction::Start)},
                false, host_now() + std::chrono::seconds(60));

  ASSERT_EQ(answers.size(), 3U);
  EXPECT_TRUE(answers[0].status);
  EXPECT_EQ(answers[1].message, "stopped");
  EXPECT_EQ(answers[2].code, ControlCode::Invalid);
}

// Asks for the end of a take; then for a reload, when the recorder has just answered.
class StopThenReload final : public ControlServer {
 public:
  StopThenReload(World& world, std::vector<std::string>& answers) : world_(world), answers_(answers) {}
  std::optional<ControlRequest> next(Duration) override {
    if (!std::exchange(asked_, true)) return take_request(TakeAction::Stop);
    const TakeOrder stop = next_take_order(world_);
    static_cast<void>(world_.takes.done.try_push({stop.number, TakeOutcome::Done, "stopped"}));
    return request(ControlAction::Reload);
  }
  void answer(std::uint64_t, const ControlAnswer& answer) override { answers_.push_back(answer.message); }

 private:
  World& world_;
  std::vector<std::string>& answers_;
  bool asked_ = false;
};

TEST(ControlWorker, ChangesTheConfigurationAfterATakeThatEnds) {
  World world;
  std::vector<std::string> answers;
  std::jthread main([&](const std::stop_token& stop) {
    MainOrder order;
    while (!stop.stop_requested() && !world.control.to_main.try_pop(order)) std::this_thread::yield();
    runtime::MainDone changed{order.number, true, "changed"};
    changed.change_follows = true;
    static_cast<void>(world.control.from_main.try_push(changed));
  });
  ControlWorker worker(std::make_unique<StopThenReload>(world, answers), one_subject(), false,
                       {&world.control, {&world.camera}, &world.takes});

  worker.run({});

  EXPECT_EQ(answers, (std::vector<std::string>{"stopped", "changed"}));
}

TEST(ControlWorker, GivesUpATakeThatDoesNotEndBeforeItStops) {
  World world;

  const auto answers = world.ask({take_request(TakeAction::Stop)});

  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].code, ControlCode::Timeout);
}

// Asks for a snapshot; then for another one, after snapshots have begun to come.
class TwoSnapshots final : public ControlServer {
 public:
  TwoSnapshots(ControlChannel& control, std::vector<ControlCode>& answers, std::stop_source& end)
      : control_(control), answers_(answers), end_(end) {}
  std::optional<ControlRequest> next(Duration) override {
    if (answers_.size() == 2) end_.request_stop();
    if (answers_.size() == 1) {
      publisher_ = std::jthread([this](const std::stop_token& stop) { publish(stop); });
      const Timestamp deadline = host_now() + std::chrono::seconds(60);
      while (control_.snapshots.front() == nullptr && host_now() < deadline) std::this_thread::yield();
      EXPECT_NE(control_.snapshots.front(), nullptr);
    }
    return request(ControlAction::GetSnapshot);
  }
  void answer(std::uint64_t, const ControlAnswer& answer) override { answers_.push_back(answer.code); }

 private:
  void publish(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (control_.snapshot_wanted.exchange(false)) static_cast<void>(control_.snapshots.try_push(Snapshot{}));
      std::this_thread::yield();
    }
  }

  ControlChannel& control_;
  std::vector<ControlCode>& answers_;
  std::stop_source& end_;
  std::jthread publisher_;
};

TEST(ControlWorker, WaitsForASnapshotAgainWhenOneCame) {
  World world;
  std::vector<ControlCode> answers;
  std::stop_source end;
  ControlWorker worker(std::make_unique<TwoSnapshots>(world.control, answers, end), one_subject(), false,
                       {&world.control, {&world.camera}});

  worker.run(end.get_token());

  ASSERT_GE(answers.size(), 2U);
  EXPECT_EQ(answers[0], ControlCode::Timeout);
  EXPECT_EQ(answers[1], ControlCode::Done);
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

TEST(ControlWorker, DrawsUndoesAndForgetsTheMasksOfACamera) {
  World world;
  std::vector<MainOrder> orders;
  std::jthread main([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      MainOrder order;
      if (!world.control.to_main.try_pop(order)) {
        std::this_thread::yield();
        continue;
      }
      orders.push_back(order);
      static_cast<void>(world.control.from_main.try_push({order.number, true, "changed"}));
    }
  });
  ControlRequest draw = request(ControlAction::DrawMasks, "north");
  draw.polygons = {{{{-0.5, -0.5}}, {{63.5, -0.5}}, {{63.5, 47.5}}, {{-0.5, 47.5}}}};

  const auto answers =
      world.ask({request(ControlAction::UndoMasks, "north"), draw, request(ControlAction::GetMasks),
                 request(ControlAction::UndoMasks, "north"), request(ControlAction::UndoMasks, "north"),
                 request(ControlAction::ForgetMasks, "north"), request(ControlAction::GetMasks, "south")});
  main.request_stop();
  main.join();

  EXPECT_THAT(answers[0].message, HasSubstr("nothing to undo"));
  EXPECT_EQ(answers[1].message, "camera 'north': 1 drawn masks, 1.00 % of the image\nchanged");
  ASSERT_EQ(answers[2].masks->size(), 1U);
  EXPECT_EQ(answers[2].masks->front().undo_steps, 1U);
  EXPECT_EQ(answers[2].masks->front().drawn.size(), 1U);
  EXPECT_EQ(answers[2].masks->front().learnt.size(), 2U);
  EXPECT_EQ(answers[3].code, ControlCode::Done);
  EXPECT_EQ(answers[4].code, ControlCode::Invalid);
  EXPECT_EQ(answers[5].code, ControlCode::Done);
  EXPECT_EQ(answers[6].code, ControlCode::NotFound);
  ASSERT_EQ(orders.size(), 3U);
  EXPECT_EQ(orders[0].drawn->camera, CameraId{0});
  EXPECT_EQ(orders[0].drawn->polygons[0][2].v, Eigen::Vector2d(63.5, 47.5));
  EXPECT_TRUE(orders[0].masks.empty()) << "the learnt masks stay";
  EXPECT_EQ(orders[1].drawn->polygons[0][0].v, Eigen::Vector2d(1.0, 1.0)) << "as before the drawing";
  EXPECT_FALSE(orders[2].drawn);
  ASSERT_EQ(orders[2].masks.size(), 1U);
  EXPECT_TRUE(orders[2].masks[0].empty());
}

TEST(ControlWorker, RefusesAMaskThatCoversNothingOrEverything) {
  World world;
  ControlRequest outside = request(ControlAction::DrawMasks, "north"), all = outside, elsewhere = outside;
  outside.polygons = {{{{700.0, 0.0}}, {{800.0, 0.0}}, {{800.0, 90.0}}}};
  all.polygons = {{{{-1.0, -1.0}}, {{1e6, -1.0}}, {{1e6, 1e6}}, {{-1.0, 1e6}}}};
  elsewhere.name = "south";

  const auto answers = world.ask({outside, all, elsewhere});

  EXPECT_EQ(answers[0].code, ControlCode::Invalid);
  EXPECT_THAT(answers[0].message,
              HasSubstr("polygon 1 covers no pixel of the image, expected corners within 0 to 639 and 0 to 479"));
  EXPECT_EQ(answers[1].code, ControlCode::Invalid);
  EXPECT_THAT(answers[1].message, HasSubstr("100.0 % of the image would be masked, expected 90 % at most"));
  EXPECT_EQ(answers[2].code, ControlCode::NotFound);
}

TEST(ControlWorker, AnswersOthersWhileMasksAreLearnt) {
  World world;

  const auto answers =
      world.ask({request(ControlAction::LearnMask), request(ControlAction::GetStatus),
                 request(ControlAction::LearnMask, "north"), request(ControlAction::LearnMask, "south")});

  ASSERT_EQ(answers.size(), 4U);
  EXPECT_TRUE(answers[0].status);
  EXPECT_THAT(answers[1].message, HasSubstr("masks are being learnt already"));
  EXPECT_THAT(answers[2].message, HasSubstr("masks are being learnt already"));
  EXPECT_EQ(answers[3].code, ControlCode::Failed);
  EXPECT_THAT(answers[3].message,
              HasSubstr("no mask was learnt, because the configuration changes or the daemon stops"));
}

TEST(ControlWorker, EndsTheLearningOfMasksWhenTheCaptureIsStoppedAndRefusesItUntilItRuns) {
  World world;
  const auto threads = obliging(world);

  const auto answers = world.ask({request(ControlAction::LearnMask), request(ControlAction::StopCapture),
                                  request(ControlAction::LearnMask), request(ControlAction::StartCapture)});

  ASSERT_EQ(answers.size(), 4U);
  EXPECT_EQ(answers[0].code, ControlCode::Failed);
  EXPECT_THAT(answers[0].message, HasSubstr("no mask was learnt, because the capture was stopped"));
  EXPECT_EQ(answers[1].message, "capture stopped");
  EXPECT_EQ(answers[2].code, ControlCode::Failed);
  EXPECT_THAT(answers[2].message, HasSubstr("capture is stopped; run mocapctl capture start"));
  EXPECT_EQ(answers[3].message, "capture started");
}

TEST(ControlWorker, LetsACameraOfTwoImagesASecondLearnAMask) {
  EXPECT_GE(longest_learning(0), std::chrono::seconds(kDefaultMaskImages / 2));
}

TEST(ControlWorker, SavesTheLearntMasksWhenEachCameraHasSentItsOwn) {
  World world;
  MainOrder saved;
  std::jthread camera_and_main([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      CameraOrder learn;
      if (world.camera.orders.try_pop(learn)) {
        static_cast<void>(world.camera.masks.try_push({.order = learn.number - 1, .polygons = {}}));  // an earlier one
        static_cast<void>(world.camera.masks.try_push({learn.number, {{{{5.0, 5.0}}, {{7.0, 5.0}}, {{7.0, 7.0}}}}}));
      }
      if (world.control.to_main.try_pop(saved)) {
        static_cast<void>(world.control.from_main.try_push({saved.number, true, "changed", true}));
      }
      std::this_thread::yield();
    }
  });

  const auto answers = world.ask({request(ControlAction::LearnMask)}, false, host_now() + std::chrono::seconds(30));

  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].message, "camera 'north': 1 polygons, 0.00 % of the image\nchanged");
  ASSERT_EQ(saved.masks.size(), 1U);
  EXPECT_EQ(saved.masks[0][0][0].v, Eigen::Vector2d(5.0, 5.0));
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
