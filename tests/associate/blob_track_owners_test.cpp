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
std::uint32_t see(BlobOwners& owners, BlobTrackId blob = kBlob) {
  owners.see(kCamera);
  return owners.owner_of(kCamera, blob);
}

/// Lets it learn in three images that the blob is this marker's.
void teach(BlobOwners& owners, std::uint32_t marker) {
  for (int image = 0; image < 3; ++image) {
    see(owners);
    owners.learn(kCamera, kBlob, marker);
  }
}

TEST(BlobOwners, KnowsWhoseA2DTrackIsAfterThreeSets) {
  BlobOwners owners(2);
  owners.expect(expect_tracks({40, 50}));

  see(owners);
  owners.learn(kCamera, kBlob, 1);
  see(owners);
  owners.learn(kCamera, kBlob, 1);
  EXPECT_EQ(see(owners), BlobOwners::kNobody);
  owners.learn(kCamera, kBlob, 1);

  EXPECT_EQ(see(owners), 1U);
  EXPECT_EQ(see(owners, BlobTrackId{8}), BlobOwners::kNobody);
  EXPECT_EQ(see(owners, BlobTrackId{}), BlobOwners::kNobody);
}

TEST(BlobOwners, FollowsTheTrackWhereverItStandsAmongTheExpected) {
  BlobOwners owners(2);
  owners.expect(expect_tracks({40, 50}));
  teach(owners, 1);

  owners.expect(expect_tracks({20, 30, 50}));
  EXPECT_EQ(see(owners), 2U);

  owners.expect(expect_tracks({40, 60}));
  EXPECT_EQ(see(owners), BlobOwners::kStranger);
}

TEST(BlobOwners, KnowsAMarkerWhose3DTrackEndedByItsName) {
  constexpr Label kName{SubjectId{0}, 3};
  Expected tracked = expect_tracks({40, 50});
  tracked.markers[1].label = kName;
  BlobOwners owners(2);
  owners.expect(tracked);
  teach(owners, 1);

  Expected told = expect_tracks({40, TrackId::kNothing});
  owners.expect(told);
  EXPECT_EQ(see(owners), BlobOwners::kStranger);
  told.markers[1].label = kName;
  owners.expect(told);

  EXPECT_EQ(see(owners), 1U);
}

TEST(BlobOwners, KnowsNothingOfA2DTrackThatWasAwayForAnImage) {
  BlobOwners owners(2);
  owners.expect(expect_tracks({40}));
  teach(owners, 0);
  ASSERT_EQ(see(owners), 0U);

  owners.see(kCamera);

  EXPECT_EQ(see(owners), BlobOwners::kNobody);
  EXPECT_EQ(see(owners), BlobOwners::kNobody);
}

TEST(BlobOwners, BelievesTheViewsThatAgreeOnAnotherOwner) {
  BlobOwners owners(2);
  owners.expect(expect_tracks({40, 50}));
  teach(owners, 0);

  see(owners);
  owners.learn(kCamera, kBlob, 1);
  EXPECT_EQ(see(owners), BlobOwners::kNobody);
  owners.learn(kCamera, kBlob, 1);
  see(owners);
  owners.learn(kCamera, kBlob, 1);

  EXPECT_EQ(see(owners), 1U);
}

}  // namespace
}  // namespace mocap::associate
