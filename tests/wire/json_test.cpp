#include "wire/codec/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "random_model.h"
#include "wire/codec/encode.h"

namespace mocap::wire {
namespace json_test {

using ::testing::HasSubstr;

TEST(JsonLine, RoundTrips) {
  testing::RandomModel random(11);
  for (int round = 0; round < 50; ++round) {
    const Snapshot sent = random.snapshot(12);

    const std::string line = to_json_line(sent);
    const Result<Snapshot> read = from_json_line(line);

    ASSERT_TRUE(read) << read.error().message;
    v1::Snapshot before;
    v1::Snapshot after;
    encode(sent, before);
    encode(*read, after);
    EXPECT_EQ(before.SerializeAsString(), after.SerializeAsString());
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
}

TEST(JsonLine, AcceptsCanonicalJsonOfOtherPrograms) {
  Snapshot snapshot;
  snapshot.number = 12;
  snapshot.instants.exposed_at = from_ns(5000000000);
  SubjectLabels& labels = snapshot.labels.push_back({});
  labels.subject = SubjectId{1};
  labels.phase = SubjectPhase::Tracking;
  LabelledMarker& marker = labels.markers.push_back({});
  marker.state = LabelState::Measured;
  marker.position.v = {0.5, 0.25, 1.0};

  EXPECT_EQ(to_json_line(snapshot),
            R"({"number":"12","instants":{"exposedAtNs":"5000000000"},"subjects":[{"subject":1,)"
            R"("phase":"SUBJECT_PHASE_TRACKING","markers":{"states":["MARKER_STATE_MEASURED"],)"
            R"("positionsM":[0.5,0.25,1],"cameras":[0],"confidencesPercent":[0],)"
            R"("trackIdsPlusOne":[0],"residualsMillipx":[0]}}]})");
}

TEST(JsonLine, NamesTheFault) {
  EXPECT_THAT(from_json_line("{").error().message, HasSubstr("not a snapshot in JSON"));
  EXPECT_THAT(from_json_line("[]").error().message, HasSubstr("not a snapshot in JSON"));
  EXPECT_THAT(from_json_line("{}").error().message, HasSubstr("instants are missing"));
  EXPECT_FALSE(from_json_line(""));
}

TEST(JsonLine, IgnoresUnknownFields) {
  const auto read = from_json_line(R"({"instants":{"exposedAtNs":"1"},"colour":{"of":["the","sky"]}})");

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->instants.exposed_at, from_ns(1));
}

}  // namespace json_test
}  // namespace mocap::wire
