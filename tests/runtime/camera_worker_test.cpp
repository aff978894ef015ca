#include "runtime/camera/camera_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "support/scripted_camera.h"

namespace mocap::runtime {
namespace camera_worker_test {

using std::chrono::milliseconds;
using support::Deliver;
using support::ScriptedCamera;
using support::Step;

class NoBlobs : public Detector {
 public:
  Detection detect(const Image&) override { return {}; }
};

class NoTracks : public BlobTracker {
 public:
  void track(BlobFrame&) override {}
};

CameraParts parts(std::deque<std::vector<Step>> starts) {
  CameraParts made;
  made.name = "north";
  made.stream = std::make_unique<StreamCounters>();
  made.camera = std::make_unique<ScriptedCamera>(CameraId{0}, std::move(starts));
  made.make_detector = [](const Image&) -> Result<std::unique_ptr<Detector>> {
    return std::unique_ptr<Detector>(std::make_unique<NoBlobs>());
  };
  made.tracker = std::make_unique<NoTracks>();
  return made;
}

CameraWorkerSettings quick() {
  CameraWorkerSettings settings;
  settings.silent_after = milliseconds(60);
  settings.first_backoff = milliseconds(1);
  settings.longest_backoff = milliseconds(4);
  return settings;
}

const Error kEnd{ErrorCode::EndOfStream, {}};
const Error kGone{ErrorCode::DeviceLost, "cable pulled"};

struct Rig {
  WakeSignal wake;
  CameraChannel channel{8, wake};

  // Runs the worker until its camera ends.
  void run(CameraParts camera, const CameraWorkerSettings& settings = quick()) {
    CameraWorker worker(std::move(camera), settings, channel);
    worker.run(std::stop_token{});
  }

  std::vector<std::uint64_t> delivered() {
    std::vector<std::uint64_t> numbers;
    BlobFrame frame;
    while (channel.frames.try_pop(frame)) numbers.push_back(frame.number);
    return numbers;
  }
};

TEST(CameraWorker, DeliversEveryImageAndReportsTheEndOfTheSource) {
  Rig rig;

  rig.run(parts({{Deliver{0}, Deliver{1}, Deliver{2}, kEnd}}));

  EXPECT_EQ(rig.delivered(), (std::vector<std::uint64_t>{0, 1, 2}));
  EXPECT_EQ(rig.channel.delivery.load(), Delivery::Ended);
}

TEST(CameraWorker, CountsGapsInTheFrameNumbers) {
  Rig rig;

  rig.run(parts({{Deliver{5}, Deliver{6}, Deliver{9}, Deliver{10}, kEnd}}));

  EXPECT_EQ(rig.channel.counters.missing_frames.read(), 2U);
}

/// Returns one blob for each image and a different count for each filter.
class BusyDetector : public Detector {
 public:
  Detection detect(const Image&) override {
    Detection found;
    found.blobs.push_back({});
    found.dropped = 1;
    found.too_small = 2;
    found.too_large = 3;
    found.not_round = 4;
    found.too_dim = 5;
    found.rows_given_up = 6;
    found.threshold_grey = 38.0;
    found.noise_grey = 2.1;
    found.background_grey = 12.0;
    return found;
  }
};

TEST(CameraWorker, CountsRejectedBlobsByFilter) {
  Rig rig;
  CameraParts camera = parts({{Deliver{0}, Deliver{1}, kEnd}});
  camera.make_detector = [](const Image&) -> Result<std::unique_ptr<Detector>> {
    return std::unique_ptr<Detector>(std::make_unique<BusyDetector>());
  };

  rig.run(std::move(camera));

  const DetectionCounts counts = rig.channel.counters.detection.counts();
  EXPECT_EQ(counts.blobs, 2U);
  EXPECT_EQ(counts.dropped, 2U);
  EXPECT_EQ(counts.too_small, 4U);
  EXPECT_EQ(counts.too_large, 6U);
  EXPECT_EQ(counts.not_round, 8U);
  EXPECT_EQ(counts.too_dim, 10U);
  EXPECT_EQ(counts.rows_given_up, 12U);
  const DetectionLevels levels = rig.channel.counters.detection.levels();
  EXPECT_EQ(levels.threshold_grey, 38.0);
  EXPECT_EQ(levels.noise_grey, 2.1);
  EXPECT_EQ(levels.background_grey, 12.0);
}

TEST(CameraWorker, ReopensALostCamera) {
  Rig rig;

  rig.run(parts({{Deliver{0}, kGone}, {Deliver{0}, kEnd}}));

  EXPECT_EQ(rig.channel.counters.reopened.read(), 1U);
  EXPECT_EQ(rig.channel.counters.frames.read(), 2U);
}

TEST(CameraWorker, LogsWhyACameraWasLost) {
  Rig rig;

  rig.run(parts({{Deliver{0}, kGone}, {kEnd}}));

  std::vector<std::string> errors;
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) {
    if (note.phase == CameraPhase::Reopening) errors.emplace_back(note.error.begin(), note.error.end());
  }
  EXPECT_EQ(errors, std::vector<std::string>{"cable pulled"});
}

TEST(CameraWorker, OmitsTheCameraNameFromTheReason) {
  Rig rig;

  rig.run(parts({{Error{ErrorCode::DeviceLost, "camera 'north': cable pulled"}}, {kEnd}}));

  std::string logged;
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) logged.append(note.error.begin(), note.error.end());
  EXPECT_EQ(logged, "cable pulled");
}

std::size_t count_in(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

TEST(CameraWorker, LogsAReasonOnceUntilTheCameraStreamsAgain) {
  Rig rig;
  testing::internal::CaptureStderr();

  rig.run(parts({{kGone}, {kGone}, {kGone}, {Deliver{0}, kGone}, {kGone}, {kEnd}}));

  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(count_in(log, "cable pulled"), 2U) << log;
}

TEST(CameraWorker, LogsAReasonOnceForTheCamerasThatFailTogether) {
  FailureFold fold;
  testing::internal::CaptureStderr();

  for (int camera = 0; camera < 8; ++camera) {
    Rig rig;
    CameraParts together = parts({{kGone}, {kGone}, {kEnd}});
    together.name = "camera" + std::to_string(camera);
    together.failures = &fold;
    rig.run(std::move(together));
    CameraNote note;
    std::size_t noted = 0;
    while (rig.channel.notes.try_pop(note)) noted += note.phase == CameraPhase::Reopening ? 1 : 0;
    EXPECT_EQ(noted, 2U);  // health has the reason for each camera
  }

  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(count_in(log, "cable pulled"), 1U) << log;
}

TEST(CameraWorker, LogsTheSilenceOfEachCameraThatMayFailTogetherWithOthers) {
  FailureFold fold;
  testing::internal::CaptureStderr();

  for (int camera = 0; camera < 2; ++camera) {
    Rig rig;
    CameraParts together = parts({{Deliver{0}}, {kEnd}});
    together.name = "camera" + std::to_string(camera);
    together.failures = &fold;
    rig.run(std::move(together));
  }

  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(count_in(log, "no image for 60 ms"), 2U) << log;
}

// A camera whose first two starts fail.
class SlowToFind : public ScriptedCamera {
 public:
  SlowToFind(Error failure, std::deque<std::vector<Step>> starts)
      : ScriptedCamera(CameraId{0}, std::move(starts)), failure_(std::move(failure)) {}

  Status start() override {
    if (++starts_ <= 2) return failure_;
    return ScriptedCamera::start();
  }

 private:
  Error failure_;
  int starts_ = 0;
};

CameraParts slow_to_find(Error failure) {
  CameraParts camera = parts({});
  camera.camera = std::make_unique<SlowToFind>(std::move(failure), std::deque<std::vector<Step>>{{Deliver{0}, kEnd}});
  return camera;
}

TEST(CameraWorker, RetriesADiscoveryInProgressWithoutBackoffOrError) {
  Rig rig;

  rig.run(slow_to_find({ErrorCode::Timeout, "still looking"}));

  EXPECT_EQ(rig.channel.counters.frames.read(), 1U);
  EXPECT_EQ(rig.channel.counters.reopened.read(), 0U);
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) EXPECT_NE(note.phase, CameraPhase::Reopening);
}

struct Noted {
  std::vector<CameraPhase> phases;
  std::string log;
};

Noted run_and_note(Rig& rig, CameraParts camera, const CameraWorkerSettings& settings) {
  Noted noted;
  testing::internal::CaptureStderr();
  rig.run(std::move(camera), settings);
  noted.log = testing::internal::GetCapturedStderr();
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) noted.phases.push_back(note.phase);
  return noted;
}

TEST(CameraWorker, WaitsForADeviceThatIsNotThereYetWithoutAnError) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = std::chrono::hours(1);

  const Noted noted = run_and_note(rig, slow_to_find({ErrorCode::NotFound, "nothing answers"}), settings);

  EXPECT_EQ(noted.phases, (std::vector{CameraPhase::Starting, CameraPhase::Starting, CameraPhase::Starting,
                                       CameraPhase::Streaming, CameraPhase::Ended}));
  EXPECT_THAT(noted.log, testing::ContainsRegex("info +camera north: nothing answers; waiting"));
  EXPECT_THAT(noted.log, testing::Not(testing::HasSubstr("error")));
}

TEST(CameraWorker, ReportsADeviceThatDoesNotAppearInTimeAsAnError) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = Duration::zero();

  const Noted noted = run_and_note(rig, slow_to_find({ErrorCode::NotFound, "nothing answers"}), settings);

  EXPECT_THAT(noted.phases, testing::Contains(CameraPhase::Reopening));
  EXPECT_THAT(noted.log, testing::ContainsRegex("error +camera north: nothing answers; the other cameras continue"));
}

TEST(CameraWorker, ReportsADeviceThatRefusesToStartAsAnErrorAtOnce) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = std::chrono::hours(1);

  const Noted noted = run_and_note(rig, slow_to_find({ErrorCode::Unsupported, "no such format"}), settings);

  EXPECT_THAT(noted.phases, testing::Contains(CameraPhase::Reopening));
  EXPECT_THAT(noted.log, testing::ContainsRegex("error +camera north: no such format"));
}

TEST(CameraWorker, ReportsALostDeviceAsAnErrorAtOnce) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = std::chrono::hours(1);
  const Error absent{ErrorCode::NotFound, "nothing answers"};

  const Noted noted = run_and_note(rig, parts({{Deliver{0}, absent}, {Deliver{1}, kEnd}}), settings);

  EXPECT_EQ(noted.phases, (std::vector{CameraPhase::Starting, CameraPhase::Streaming, CameraPhase::Reopening,
                                       CameraPhase::Streaming, CameraPhase::Ended}));
}

TEST(CameraWorker, ReopensASilentCamera) {
  Rig rig;

  rig.run(parts({{Deliver{0}}, {Deliver{0}, kEnd}}));

  EXPECT_EQ(rig.channel.counters.reopened.read(), 1U);
}

TEST(CameraWorker, ReportsASilentCameraAndTheReasonUntilItStreams) {
  Rig rig;

  rig.run(parts({{Deliver{0}}, {kGone}, {Deliver{0}, kEnd}}));

  std::vector<CameraPhase> phases;
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) {
    phases.push_back(note.phase);
    if (note.phase != CameraPhase::Silent) continue;
    EXPECT_THAT(std::string(note.error.begin(), note.error.end()), testing::HasSubstr("no image for 60 ms"));
  }
  EXPECT_EQ(phases, (std::vector{CameraPhase::Starting, CameraPhase::Streaming, CameraPhase::Silent,
                                 CameraPhase::Reopening, CameraPhase::Streaming, CameraPhase::Ended}));
}

TEST(CameraWorker, CountsADamagedImageAndKeepsTheCamera) {
  Rig rig;

  rig.run(parts({{Deliver{0}, Error{ErrorCode::Io, "half an image"}, Deliver{2}, kEnd}}));

  EXPECT_EQ(rig.channel.counters.failed_frames.read(), 1U);
  EXPECT_EQ(rig.channel.counters.reopened.read(), 0U);
  EXPECT_EQ(rig.delivered(), (std::vector<std::uint64_t>{0, 2}));
}

TEST(CameraWorker, LogsEachKindOfUnusableImageOnce) {
  Rig rig;
  const Error broken{ErrorCode::Io, "camera 'north': image 1 came broken"};
  const Error broken_too{ErrorCode::Io, "camera 'north': image 2 came broken"};
  const Error late{ErrorCode::Io, "camera 'north': image 3 is late"};

  const Noted noted =
      run_and_note(rig, parts({{Deliver{0}, broken, broken_too, late, broken, Deliver{5}, kEnd}}), quick());

  EXPECT_THAT(noted.log, testing::ContainsRegex("warn +camera north: unusable image: image 1 came broken"));
  EXPECT_EQ(count_in(noted.log, "came broken"), 1U) << noted.log;
  EXPECT_EQ(count_in(noted.log, "unusable image: image 3 is late"), 1U) << noted.log;
}

TEST(CameraWorker, LosesACameraThatOnlyGivesUnusableImagesAndNamesTheReason) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = Duration::zero();
  testing::internal::CaptureStderr();

  const Error first{ErrorCode::Io, "camera 'north': image 6 has a stamp of tomorrow"};
  rig.run(parts({{first, Error{ErrorCode::Io, "camera 'north': image 7 has a stamp of tomorrow"}, Deliver{8}},
                 {first, Error{ErrorCode::Io, "camera 'north': image 9 has a stamp of tomorrow"}, Deliver{10}},
                 {Deliver{11}, kEnd}}),
          settings);

  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(rig.delivered(), std::vector<std::uint64_t>{11});
  EXPECT_EQ(rig.channel.counters.reopened.read(), 2U);
  EXPECT_EQ(count_in(log, "no usable image for 0 s: image"), 1U) << log;
  std::vector<std::string> errors;
  CameraNote note;
  while (rig.channel.notes.try_pop(note)) {
    if (note.phase == CameraPhase::Reopening) errors.emplace_back(note.error.begin(), note.error.end());
  }
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[1], "no usable image for 0 s: image 9 has a stamp of tomorrow");
}

// A camera that is triggered in bursts may be silent for longer than the span before its unusable image. Here the span
// is 0 s, so that every silence is longer.
TEST(CameraWorker, KeepsACameraThatGivesOneUnusableImageAfterEachUsableOne) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = Duration::zero();
  const Error broken{ErrorCode::Io, "packets missing"};

  rig.run(parts({{Deliver{0}, broken, Deliver{2}, broken, Deliver{4}, kEnd}, {kEnd}}), settings);

  EXPECT_EQ(rig.delivered(), (std::vector<std::uint64_t>{0, 2, 4}));
  EXPECT_EQ(rig.channel.counters.reopened.read(), 0U);
}

// Other cameras of the run may be live.
TEST(CameraWorker, KeepsARecordingWithManyUnusableImagesAndWithSilence) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_image_within = settings.silent_after = Duration::zero();
  const Error broken{ErrorCode::Io, "not a PNG"}, nothing{ErrorCode::Timeout, {}};
  CameraParts camera =
      parts({{nothing, broken, broken, broken, Deliver{3}, nothing, nothing, Deliver{4}, kEnd}, {kEnd}});
  camera.recorded = true;

  rig.run(std::move(camera), settings);

  EXPECT_EQ(rig.delivered(), (std::vector<std::uint64_t>{3, 4}));
  EXPECT_EQ(rig.channel.counters.reopened.read(), 0U);
}

// A camera whose exposure is changed after two images, and which ends after six.
class AdjustedCamera : public Camera {
 public:
  AdjustedCamera(CameraChannel& channel, int& learnt_from) : channel_(channel), learnt_from_(learnt_from) {}
  Status start() override { return {}; }
  Result<Frame> next(Duration) override {
    if (channel_.masks.front() != nullptr && learnt_from_ == 0) learnt_from_ = images_;
    if (images_ == 6) return kEnd;
    if (++images_ == 2) static_cast<void>(channel_.orders.try_push(CameraOrder{2, CameraAction::Adjust, 500.0, {}, 0}));
    const Timestamp at = from_ns(images_ * 10'000'000);
    return Frame{CameraId{0}, static_cast<std::uint64_t>(images_), at, at, {pixels_, 64, 64, 48, PixelFormat::Mono8}};
  }
  std::optional<CameraAdjustment> adjustment() const override { return CameraAdjustment{100.0, std::nullopt}; }
  Status adjust(const CameraAdjustment&) override { return {}; }
  void stop() noexcept override {}

 private:
  CameraChannel& channel_;
  int& learnt_from_;  // images so far when the mask came
  std::vector<std::byte> pixels_ = std::vector<std::byte>(64 * 48);
  int images_ = 0;
};

TEST(CameraWorker, LearnsAMaskFromImagesOfOneExposure) {
  Rig rig;
  int learnt_from = 0;
  CameraParts camera = parts({});
  camera.camera = std::make_unique<AdjustedCamera>(rig.channel, learnt_from);
  camera.make_detector = [](const Image&) -> Result<std::unique_ptr<Detector>> {
    return std::unique_ptr<Detector>(std::make_unique<BusyDetector>());
  };
  ASSERT_TRUE(rig.channel.orders.try_push(CameraOrder{1, CameraAction::LearnMask, {}, {}, 4}));

  rig.run(std::move(camera));

  EXPECT_EQ(learnt_from, 6) << "two images before the change, four after it";
}

TEST(CameraWorker, RejectsImagesWhoseSizeDiffersFromTheRig) {
  Rig rig;
  CameraParts camera = parts({{Deliver{0, 32, 32}}, {kEnd}});
  camera.expected_width_px = 64;
  camera.expected_height_px = 48;

  rig.run(std::move(camera));

  EXPECT_TRUE(rig.delivered().empty());
  EXPECT_EQ(rig.channel.counters.reopened.read(), 1U);
}

TEST(CameraWorker, DropsAndCountsTheNewImageIfTheQueueIsFull) {
  Rig rig;
  std::vector<Step> list;
  for (std::uint64_t i = 0; i < 20; ++i) list.push_back(Deliver{i});
  list.push_back(kEnd);

  rig.run(parts({list}));

  EXPECT_EQ(rig.channel.counters.dropped_queue_full.read(), 12U);
  EXPECT_EQ(rig.delivered().front(), 0U);
}

TEST(CameraWorker, LosesNothingIfItMayWait) {
  Rig rig;
  std::vector<Step> list;
  for (std::uint64_t i = 0; i < 500; ++i) list.push_back(Deliver{i});
  list.push_back(kEnd);
  CameraWorkerSettings settings = quick();
  settings.lossless = true;

  std::jthread worker([&] { rig.run(parts({list}), settings); });
  std::uint64_t received = 0;
  while (received < 500) {
    const auto ticket = rig.wake.ticket();
    if (rig.channel.frames.front() == nullptr) {
      rig.wake.wait(ticket, std::chrono::seconds(10));
      continue;
    }
    ASSERT_EQ(rig.channel.frames.front()->number, received++);
    rig.channel.frames.pop();
    rig.channel.room.signal();
  }

  EXPECT_EQ(rig.channel.counters.dropped_queue_full.read(), 0U);
}

TEST(CameraWorker, StopsDuringALongBackoff) {
  Rig rig;
  CameraWorkerSettings settings = quick();
  settings.first_backoff = settings.longest_backoff = std::chrono::seconds(60);
  CameraWorker worker(parts({}), settings, rig.channel);

  const Timestamp before = host_now();
  {
    std::jthread thread([&](const std::stop_token& stop) { worker.run(stop); });
    CameraNote note;
    while (note.error.empty()) {
      const auto ticket = rig.wake.ticket();
      if (!rig.channel.notes.try_pop(note)) rig.wake.wait(ticket, milliseconds(10));
    }
  }

  EXPECT_LT(host_now() - before, std::chrono::seconds(20));
}

}  // namespace camera_worker_test
}  // namespace mocap::runtime
