#include "take/recorder/lead_in.h"

#include <gtest/gtest.h>

namespace mocap::take {
namespace lead_in_test {

class LeadInTest : public testing::Test {
 protected:
  void belief(std::uint64_t after_set) {
    v1::Belief belief;
    belief.set_after_set(after_set);
    belief.set_state("state " + std::to_string(after_set));
    const std::string bytes = belief.SerializeAsString();
    lead_in_.add({BufferedKind::Belief, 0, time_of(after_set), bytes});
  }
  void set(std::uint64_t number) {
    v1::Snapshot snapshot;
    snapshot.set_number(number);
    const std::string bytes = snapshot.SerializeAsString();
    lead_in_.add({BufferedKind::Snapshot, 0, time_of(number), bytes});
  }
  void image(std::uint64_t number) {
    v1::CameraBlobs blobs;
    blobs.set_number(number);
    const std::string bytes = blobs.SerializeAsString();
    lead_in_.add({BufferedKind::Blobs, 0, time_of(number), bytes});
  }
  static Timestamp time_of(std::uint64_t set) { return from_ns(0) + set * std::chrono::milliseconds(100); }

  v1::Belief finished() {
    v1::Belief belief;
    const auto bytes = lead_in_.finish("mocapd test");
    EXPECT_TRUE(bytes && belief.ParseFromString(*bytes));
    return belief;
  }

  LeadIn lead_in_;
};

TEST_F(LeadInTest, HasTheSetsAfterTheBeliefAndTheImagesThatTheyMayHave) {
  for (std::uint64_t i = 1; i <= 30; ++i) {
    image(i);
    set(i);
    if (i == 22) belief(20);
  }

  const v1::Belief found = finished();

  EXPECT_EQ(found.producer(), "mocapd test");
  EXPECT_EQ(found.after_set(), 20U);
  EXPECT_EQ(found.state(), "state 20");
  ASSERT_EQ(found.sets_size(), 10);
  EXPECT_EQ(found.sets(0).number(), 21U);
  EXPECT_EQ(found.images(0).number(), 10U) << "one second before the belief";
  EXPECT_EQ(found.images(found.images_size() - 1).number(), 30U);
}

TEST_F(LeadInTest, HasTheLastBelief) {
  belief(5);
  set(6);
  belief(7);
  set(8);

  const v1::Belief found = finished();

  EXPECT_EQ(found.after_set(), 7U);
  EXPECT_EQ(found.sets_size(), 1);
}

TEST_F(LeadInTest, IsEmptyWithoutABelief) {
  image(1);
  set(1);

  EXPECT_FALSE(lead_in_.finish("mocapd test"));
}

}  // namespace lead_in_test
}  // namespace mocap::take
