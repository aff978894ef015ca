#include "runtime/pipeline.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "fusion/idle_parts.h"
#include "runtime/report/status_line.h"
#include "support/scripted_camera.h"

namespace mocap::runtime {
namespace pipeline_test {

using std::chrono::milliseconds;
using support::Deliver;
using support::ScriptedCamera;
using support::Step;

const Error kEnd{ErrorCode::EndOfStream, {}};

class NoBlobs : public Detector {
 public:
  Detection detect(const Image&) override { return {}; }
};

class NoTracks : public BlobTracker {
 public:
  void track(BlobFrame&) override {}
};

// Counts of the published messages, readable while the publish thread runs.
struct Sent {
  std::atomic<std::uint64_t> snapshots{0};
  std::atomic<std::uint64_t> complete{0};
  std::atomic<std::uint64_t> descriptions{0};
  std::atomic<std::uint64_t> reports{0};
  std::atomic<std::uint64_t> recorded{0};  // records of the first recording in the last report
  std::atomic<bool> in_order{true};
  WakeSignal changed;

  // Waits until `reached` returns true; returns false after 20 s.
  template <class Reached>
  bool wait_until(Reached reached) {
    const Timestamp limit = host_now() + std::chrono::seconds(20);
    for (;;) {
      const auto ticket = changed.ticket();
      if (reached()) return true;
      if (host_now() > limit) return false;
      changed.wait(ticket, milliseconds(100));
    }
  }
};

class MemoryPublisher : public Publisher {
 public:
  explicit MemoryPublisher(Sent& sent) : sent_(sent) {}
  Status describe(const Description&) override {
    ++sent_.descriptions;
    return {};
  }
  Status publish(Snapshot& snapshot) override {
    if (sent_.snapshots > 0 && snapshot.number <= last_) sent_.in_order = false;
    last_ = snapshot.number;
    if (snapshot.views.size() == snapshot.expected_views) ++sent_.complete;
    ++sent_.snapshots;
    sent_.changed.signal();
    return {};
  }
  Status report(const Health& health) override {
    ++sent_.reports;
    if (!health.recordings.empty()) sent_.recorded = health.recordings[0].records;
    sent_.changed.signal();
    return {};
  }

 private:
  Sent& sent_;
  std::uint64_t last_ = 0;
};

class CountingWriter : public Writer {
 public:
  explicit CountingWriter(std::atomic<std::uint64_t>& written) : written_(written) {}
  Status write(const Snapshot&) override {
    ++written_;
    return {};
  }
  Status finish() override { return {}; }

 private:
  std::atomic<std::uint64_t>& written_;
};

// Writes `space` snapshots of 10 bytes, then fails.
class FullDiskWriter : public Writer {
 public:
  FullDiskWriter(std::atomic<std::uint64_t>& calls, std::uint64_t space) : calls_(calls), space_(space) {}
  Status write(const Snapshot&) override {
    ++calls_;
    if (written_ == space_) return Error{ErrorCode::Io, "the disk is full"};
    ++written_;
    return {};
  }
  std::string path() const override { return "take.jsonl"; }
  RecordingSize size() const override { return {10 * written_, written_}; }
  Status finish() override { return {}; }

 private:
  std::atomic<std::uint64_t>& calls_;
  std::uint64_t space_;
  std::uint64_t written_ = 0;
};

std::vector<Step> images(std::uint64_t count, bool then_end) {
  std::vector<Step> list;
  for (std::uint64_t i = 0; i < count; ++i) list.push_back(Deliver{i});
  if (then_end) list.push_back(kEnd);
  return list;
}

PipelineParts parts(std::vector<std::deque<std::vector<Step>>> scripts, Sent& sent) {
  PipelineParts made;
  for (std::uint32_t i = 0; i < scripts.size(); ++i) {
    CameraParts camera;
    camera.name = "camera" + std::to_string(i);
    camera.stream = std::make_unique<StreamCounters>();
    camera.camera = std::make_unique<ScriptedCamera>(CameraId{i}, std::move(scripts[i]));
    camera.make_detector = [](const Image&) -> Result<std::unique_ptr<Detector>> {
      return std::unique_ptr<Detector>(std::make_unique<NoBlobs>());
    };
    camera.tracker = std::make_unique<NoTracks>();
    made.cameras.push_back(std::move(camera));
    CameraModel model;
    model.name = "camera" + std::to_string(i);
    made.description.cameras.push_back(model);
  }
  made.fusion = std::make_unique<fusion::Fusion>(fusion::make_idle_parts(), static_cast<std::uint32_t>(scripts.size()));
  made.publisher = std::make_unique<MemoryPublisher>(sent);
  return made;
}

PipelineSettings lossless() {
  PipelineSettings settings;
  settings.lossless = true;
  return settings;
}

TEST(Pipeline, PublishesEverySetOfAReplayInOrder) {
  Sent sent;
  Pipeline pipeline(lossless(), parts({{images(2000, true)}, {images(2000, true)}, {images(2000, true)}}, sent));

  ASSERT_TRUE(sent.wait_until([&] { return pipeline.finished(); }));

  EXPECT_EQ(sent.snapshots, 2000U);
  EXPECT_EQ(sent.complete, 2000U);
  EXPECT_TRUE(sent.in_order);
}

TEST(Pipeline, WritesEverySetOfAReplay) {
  Sent sent;
  std::atomic<std::uint64_t> written{0};
  PipelineParts made = parts({{images(500, true)}, {images(500, true)}}, sent);
  made.writers.push_back(std::make_unique<CountingWriter>(written));
  Pipeline pipeline(lossless(), std::move(made));

  ASSERT_TRUE(sent.wait_until([&] { return pipeline.finished(); }));
  pipeline.stop();

  EXPECT_EQ(written, 500U);
}

TEST(Pipeline, WritesNothingAfterAFailedWriteAndReportsIt) {
  Sent sent;
  std::atomic<std::uint64_t> calls{0};
  PipelineParts made = parts({{images(500, true)}}, sent);
  made.writers.push_back(std::make_unique<FullDiskWriter>(calls, 100));
  Pipeline pipeline(lossless(), std::move(made));

  ASSERT_TRUE(sent.wait_until([&] { return pipeline.finished(); }));
  pipeline.stop();

  EXPECT_EQ(sent.snapshots, 500U);
  EXPECT_EQ(calls, 101U);
  ASSERT_EQ(pipeline.recordings().size(), 1U);
  const RecordingProgress& recording = *pipeline.recordings()[0];
  EXPECT_EQ(recording.path(), "take.jsonl");
  EXPECT_EQ(recording.state(), RecordingState::Failed);
  EXPECT_EQ(recording.error(), "the disk is full");
  EXPECT_EQ(recording.size().records, 100U);
  EXPECT_EQ(pipeline.side_counters().written.read(), 100U);
  EXPECT_EQ(totals_of(pipeline).failed_recordings, std::vector<std::string>{"take.jsonl"});
}

TEST(Pipeline, ReportsTheSizeOfARecording) {
  Sent sent;
  std::atomic<std::uint64_t> calls{0};
  PipelineParts made = parts({{images(50, false)}}, sent);
  made.writers.push_back(std::make_unique<FullDiskWriter>(calls, 1000));
  PipelineSettings settings;
  settings.publish.report_every = milliseconds(10);
  Pipeline pipeline(settings, std::move(made));

  ASSERT_TRUE(sent.wait_until([&] { return sent.recorded >= 1; }));
  EXPECT_EQ(pipeline.recordings()[0]->state(), RecordingState::Recording);
  pipeline.stop();

  EXPECT_EQ(pipeline.recordings()[0]->state(), RecordingState::Ended);
  EXPECT_EQ(pipeline.recordings()[0]->size().records, calls);
  EXPECT_EQ(pipeline.recordings()[0]->size().bytes, 10 * calls);
}

TEST(Pipeline, ContinuesWithoutAMissingCamera) {
  Sent sent;
  Pipeline pipeline({}, parts({{images(200, false)}, {}}, sent));

  EXPECT_TRUE(sent.wait_until([&] { return sent.snapshots >= 1; }));
}

TEST(Pipeline, FinishesAReplayInWhichOneCameraEndsEarly) {
  Sent sent;
  Pipeline pipeline(lossless(), parts({{images(300, true)}, {images(100, true)}}, sent));

  ASSERT_TRUE(sent.wait_until([&] { return pipeline.finished(); }));

  EXPECT_EQ(sent.snapshots, 300U);
  EXPECT_EQ(sent.complete, 100U);
}

TEST(Pipeline, ReportsHealthAndProgress) {
  Sent sent;
  PipelineSettings settings;
  settings.publish.report_every = milliseconds(10);
  Pipeline pipeline(settings, parts({{images(10, false)}}, sent));

  ASSERT_TRUE(sent.wait_until([&] { return sent.reports >= 2; }));

  EXPECT_TRUE(pipeline.progressed());
}

TEST(Pipeline, StopsWithinASecondWithASilentCamera) {
  Sent sent;
  Pipeline pipeline({}, parts({{images(5, false)}, {images(5, false)}}, sent));
  ASSERT_TRUE(sent.wait_until([&] { return sent.snapshots >= 1; }));

  const Timestamp before = host_now();
  pipeline.stop();

  EXPECT_LT(host_now() - before, std::chrono::seconds(1));
}

}  // namespace pipeline_test
}  // namespace mocap::runtime
