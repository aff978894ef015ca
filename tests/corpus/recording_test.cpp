#include "corpus/recording.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::corpus {
namespace recording_test {

Recording example() {
  Recording recording;
  recording.about = "a lamp";
  recording.bodies = {"openmocap18", "baseline41"};
  recording.rate_hz = 40.0;
  recording.utc_stamps = true;
  recording.patience = std::chrono::milliseconds(2);
  chaos::Arrival arrival;
  arrival.first_byte = from_ns(1'000'000);
  arrival.received = from_ns(2'000'000);
  arrival.camera = CameraId{3};
  arrival.number = 7;
  arrival.stamp = std::chrono::hours(9);
  arrival.blobs.resize(2);
  arrival.blobs[1].centroid = {{12.5, 3.25}};
  recording.inputs = {{from_ns(3'000'000), arrival}, {from_ns(4'000'000), Order{OrderKind::TakeStart, 0, 1.0 / 3.0}}};
  recording.seed = 12;
  recording.feed_faults = {{chaos::FaultKind::MessagesLost, 0.1, 0.2, 0, 1.0 / 7.0}};
  recording.truths = {{from_ns(3'500'000), {{1, 5, {0.5F, -1.0F, 2.0F}}}}};
  return recording;
}

TEST(CorpusRecording, ReadsBackWhatWasWritten) {
  const support::TemporaryFolder folder;
  const Recording written = example();
  ASSERT_TRUE(write_recording(folder.path() / "a.mcap", written));

  const auto read = read_recording(folder.path() / "a.mcap");

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->about, "a lamp");
  EXPECT_EQ(read->bodies, written.bodies);
  EXPECT_EQ(read->rate_hz, 40.0);
  EXPECT_TRUE(read->utc_stamps);
  EXPECT_EQ(read->patience, written.patience);
  ASSERT_EQ(read->inputs.size(), 2U);
  const auto& arrival = std::get<chaos::Arrival>(read->inputs[0].what);
  EXPECT_EQ(read->inputs[0].at, from_ns(3'000'000));
  EXPECT_EQ(arrival.first_byte, from_ns(1'000'000));
  EXPECT_EQ(arrival.received, from_ns(2'000'000));
  EXPECT_EQ(arrival.stamp, Duration(std::chrono::hours(9)));
  EXPECT_EQ(arrival.camera, CameraId{3});
  EXPECT_EQ(arrival.number, 7U);
  ASSERT_EQ(arrival.blobs.size(), 2U);
  EXPECT_EQ(arrival.blobs[1].centroid.v.x(), 12.5);
  EXPECT_EQ(std::get<Order>(read->inputs[1].what), (Order{OrderKind::TakeStart, 0, 1.0 / 3.0}));
  EXPECT_EQ(read->seed, 12U);
  EXPECT_EQ(read->feed_faults, written.feed_faults);
  ASSERT_EQ(read->truths.size(), 1U);
  EXPECT_EQ(read->truths[0].markers[0].position_m[2], 2.0F);
}

TEST(CorpusRecording, IsNotOverwritten) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(write_recording(folder.path() / "a.mcap", example()));

  EXPECT_EQ(write_recording(folder.path() / "a.mcap", example()).error().code, ErrorCode::Busy);
}

TEST(CorpusRecording, IsRefusedIfItIsAnotherFile) {
  const support::TemporaryFolder folder;

  EXPECT_FALSE(read_recording(folder.path() / "none.mcap"));
  EXPECT_FALSE(read_recording(folder.write("text.mcap", "nothing")));
}

}  // namespace recording_test
}  // namespace mocap::corpus
