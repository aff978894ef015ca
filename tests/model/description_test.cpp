#include "model/description.h"

#include <gtest/gtest.h>

namespace mocap {
namespace description_test {

TEST(Description, TakesLengthsOffsetsAndVersionOfAFit) {
  Description before;
  before.version = 4;
  before.subjects.resize(2);
  for (Subject& subject : before.subjects) {
    subject.name = "actor";
    subject.marker_set.skeleton.bones.resize(2);
    subject.marker_set.markers.resize(1);
    subject.marker_set.markers[0].name = "Head";
  }
  SubjectFit fit;
  fit.subject = SubjectId{1};
  fit.description_version = 5;
  fit.rest_offsets_m.push_back({0.0, 0.0, 1.0});
  fit.rest_offsets_m.push_back({0.0, 0.0, 0.5});
  fit.marker_offsets_m.push_back({0.0, 0.125, 0.0});

  const Description after = with_fit(before, fit);

  EXPECT_EQ(after.version, 5U);
  EXPECT_EQ(after.subjects[1].marker_set.skeleton.bones[1].rest_offset_m, Eigen::Vector3d(0.0, 0.0, 0.5));
  EXPECT_EQ(after.subjects[1].marker_set.markers[0].offset_m, Eigen::Vector3d(0.0, 0.125, 0.0));
  EXPECT_EQ(after.subjects[1].marker_set.markers[0].name, "Head");
  EXPECT_EQ(after.subjects[0].marker_set.markers[0].offset_m, before.subjects[0].marker_set.markers[0].offset_m);
}

}  // namespace description_test
}  // namespace mocap
