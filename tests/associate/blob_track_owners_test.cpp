#include "associate/predicted/blob_track_owners.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap::associate {
namespace {

constexpr CameraId kCamera{1};
constexpr BlobTrackId kBlob{7};

/// Expected markers of these tracks.
Expected expect_tracks(const std::vector<std::uint32_t>& tracks) {
  Expected expected;
  for (const std::uint32_t track : tracks) {
    ExpectedMarker marker;
    marker.track = TrackId{track};
    expected.markers.push_back(marker);
  }
  return expected;
}

/// One image of the camera, with the blob in it: whose it is.
std::uint32_t begin_image(BlobTrackOwners& owners, BlobTrackId blob = kBlob) {
  owners.begin_image(kCamera);
  return owners.predicted_marker(kCamera, blob);
}

/// Lets it learn in three images that the blob is this marker's.
void teach(BlobTrackOwners& owners, std::uint32_t marker) {
  for (int image = 0; image < 3; ++image) {
    begin_image(owners);
    owners.associate(kCamera, kBlob, marker);
  }
}

TEST(BlobTrackOwners, KnowsWhoseA2DTrackIsAfterThreeSets) {
  BlobTrackOwners owners(2);
  owners.set_predictions(expect_tracks({40, 50}));

  begin_image(owners);
  owners.associate(kCamera, kBlob, 1);
  begin_image(owners);
  owners.associate(kCamera, kBlob, 1);
  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnknown);
  owners.associate(kCamera, kBlob, 1);

  EXPECT_EQ(begin_image(owners), 1U);
  EXPECT_EQ(begin_image(owners, BlobTrackId{8}), BlobTrackOwners::kUnknown);
  EXPECT_EQ(begin_image(owners, BlobTrackId{}), BlobTrackOwners::kUnknown);
}

TEST(BlobTrackOwners, FollowsTheTrackWhereverItStandsAmongTheExpected) {
  BlobTrackOwners owners(2);
  owners.set_predictions(expect_tracks({40, 50}));
  teach(owners, 1);

  owners.set_predictions(expect_tracks({20, 30, 50}));
  EXPECT_EQ(begin_image(owners), 2U);

  owners.set_predictions(expect_tracks({40, 60}));
  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnpredicted);
}

TEST(BlobTrackOwners, KnowsAMarkerWhose3DTrackEndedByItsName) {
  constexpr Label kName{SubjectId{0}, 3};
  Expected tracked = expect_tracks({40, 50});
  tracked.markers[1].label = kName;
  BlobTrackOwners owners(2);
  owners.set_predictions(tracked);
  teach(owners, 1);

  Expected told = expect_tracks({40, TrackId::kNothing});
  owners.set_predictions(told);
  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnpredicted);
  told.markers[1].label = kName;
  owners.set_predictions(told);

  EXPECT_EQ(begin_image(owners), 1U);
}

TEST(BlobTrackOwners, KnowsNothingOfA2DTrackThatWasAwayForAnImage) {
  BlobTrackOwners owners(2);
  owners.set_predictions(expect_tracks({40}));
  teach(owners, 0);
  ASSERT_EQ(begin_image(owners), 0U);

  owners.begin_image(kCamera);

  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnknown);
  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnknown);
}

TEST(BlobTrackOwners, BelievesTheViewsThatAgreeOnAnotherOwner) {
  BlobTrackOwners owners(2);
  owners.set_predictions(expect_tracks({40, 50}));
  teach(owners, 0);

  begin_image(owners);
  owners.associate(kCamera, kBlob, 1);
  EXPECT_EQ(begin_image(owners), BlobTrackOwners::kUnknown);
  owners.associate(kCamera, kBlob, 1);
  begin_image(owners);
  owners.associate(kCamera, kBlob, 1);

  EXPECT_EQ(begin_image(owners), 1U);
}

}  // namespace
}  // namespace mocap::associate
