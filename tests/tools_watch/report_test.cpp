#include "watch/report.h"

#include <gmock/gmock.h>

#include "watch/feed_state.h"
#include "wire/codec/encode.h"
#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace report_test {

using testing::HasSubstr;
using testing::Not;

constexpr Timestamp kNow = from_ns(5'000'000'000);

/// A feed with one snapshot, and with health reports of one camera that have the given counts.
class Feed {
 public:
  Feed() {
    v1::Snapshot message;
    wire::encode(Snapshot{}, message);
    state_.take({std::string(wire::kSnapshotTopic), message.SerializeAsString()}, kNow);
  }

  void report(std::int64_t at_s, std::uint64_t frames, const DetectionCounts& counts) {
    Health health;
    health.at = from_ns(at_s * 1'000'000'000);
    health.cameras.resize(1);
    health.cameras[0].name = "left";
    health.cameras[0].frames = frames;
    health.cameras[0].detection = counts;
    health.cameras[0].levels = {38.0, 2.1, 12.0};
    v1::Health message;
    wire::encode(health, message);
    state_.take({std::string(wire::kHealthTopic), message.SerializeAsString()}, kNow);
  }

  void report_recording(const RecordingHealth& recording) {
    Health health;
    health.at = from_ns(1'000'000'000);
    health.recordings.push_back(recording);
    v1::Health message;
    wire::encode(health, message);
    state_.take({std::string(wire::kHealthTopic), message.SerializeAsString()}, kNow);
  }

  void report_missing(const std::string& reason) {
    Health health;
    health.at = from_ns(1'000'000'000);
    health.searches.emplace_back().sentence = bounded_text<511>(reason);
    v1::Health message;
    wire::encode(health, message);
    state_.take({std::string(wire::kHealthTopic), message.SerializeAsString()}, kNow);
  }

  std::string summary() const { return summary_json(state_, "tcp://127.0.0.1:5570", std::chrono::seconds(1)); }
  std::string line() const { return status_line(state_, kNow, std::string::npos); }

 private:
  FeedState state_;
};

DetectionCounts counts(std::uint64_t blobs, std::uint64_t too_small) {
  DetectionCounts made;
  made.blobs = blobs;
  made.too_small = too_small;
  return made;
}

TEST(StatusLine, ReportsWhyACameraFoundNoBlobsInTheLastSecond) {
  Feed feed;
  feed.report(1, 1000, counts(500, 100));
  EXPECT_THAT(feed.line(), Not(HasSubstr("left")));

  feed.report(2, 1060, counts(500, 312));
  EXPECT_THAT(feed.line(), HasSubstr(" | left: 0 blobs in 60 images: 212 too small (threshold 38 grey)"));

  feed.report(3, 1120, counts(560, 312));
  EXPECT_THAT(feed.line(), Not(HasSubstr("left")));
}

TEST(StatusLine, ShowsARecordingThatFailed) {
  Feed feed;
  feed.report_recording({"take.pb", RecordingState::Recording, 4096, 12, ""});
  EXPECT_THAT(feed.line(), Not(HasSubstr("take.pb")));
  EXPECT_THAT(feed.summary(),
              HasSubstr(R"("recordings":[{"path":"take.pb","state":"recording","size_bytes":4096,"records":12,)"));

  feed.report_recording({"take.pb", RecordingState::Failed, 4096, 12, "recording 'take.pb' cannot be written: full"});
  EXPECT_THAT(feed.line(), HasSubstr(" | recording 'take.pb' cannot be written: full"));
}

TEST(StatusLine, TreatsDecreasedCountsAsARestart) {
  Feed feed;
  feed.report(9, 1000, counts(500, 100));
  feed.report(1, 60, counts(0, 0));

  EXPECT_THAT(feed.line(), Not(HasSubstr("left")));
}

TEST(StatusLine, SaysWhyASubjectIsNotFound) {
  Feed feed;
  feed.report_missing("anna is not found: no camera sees a marker");

  EXPECT_THAT(feed.line(), HasSubstr("anna is not found: no camera sees a marker"));
  EXPECT_THAT(feed.summary(), HasSubstr(R"("missing_subjects":["anna is not found: no camera sees a marker"])"));
}

TEST(StatusLine, HasNoCharacterThatATerminalObeys) {
  Feed feed;
  feed.report_missing("\x1b[2Janna\r is not found");

  EXPECT_THAT(feed.line(), HasSubstr(" [2Janna  is not found"));
}

}  // namespace report_test
}  // namespace mocap::watch
