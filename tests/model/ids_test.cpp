#include "model/ids.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace mocap {
namespace ids_test {

TEST(Ids, NameNothingByDefault) {
  EXPECT_FALSE(CameraId{}.names_something());
  EXPECT_TRUE(CameraId{0}.names_something());
  EXPECT_FALSE(Label{}.names_something());
  EXPECT_TRUE((Label{SubjectId{0}, 0}.names_something()));
}

TEST(Ids, OfDifferentKindsDoNotConvert) {
  EXPECT_FALSE((std::is_convertible_v<CameraId, SubjectId>));
  EXPECT_FALSE((std::is_assignable_v<TrackId&, BlobTrackId>));
}

TEST(Ids, AreOrderedByTheirValuesWithNoneLast) {
  EXPECT_LT(TrackId{1}, TrackId{2});
  EXPECT_LT(TrackId{2}, TrackId{});
  EXPECT_EQ(TrackId{}, TrackId{});
}

TEST(Labels, AreOrderedBySubjectAndThenByMarker) {
  const Label last_of_first{SubjectId{0}, 52};
  const Label first_of_second{SubjectId{1}, 0};

  EXPECT_LT(last_of_first, first_of_second);
  EXPECT_LT(first_of_second, (Label{SubjectId{1}, 1}));
  EXPECT_NE(last_of_first, (Label{SubjectId{1}, 52}));
}

}  // namespace ids_test
}  // namespace mocap
