#include "label/subject_search.h"

#include <gtest/gtest.h>

#include <random>

#include "kinematics/pose_fit.h"
#include "label/test_tracks.h"
#include "support/test_body.h"

namespace mocap::label {
namespace subject_search_test {

constexpr Duration kStep = std::chrono::microseconds(8333);

// A body that stands still, and one search for it.
struct Search {
  explicit Search(bool fitted, const std::vector<Pose>& locals = {}, const LabelSettings& settings = {})
      : set(test::person("baseline41")),
        truth(set, kinematics::PoseFit::Lengths::Fixed),
        search(settings, {"actor", set, fitted}) {
    if (!locals.empty()) truth.set_locals(locals);
    for (std::size_t m = 0; m < set.markers.size(); ++m)
      tracked.push_back(test::detected_track(static_cast<std::uint32_t>(100 + m), truth.marker_at(m)));
  }

  // Null if nothing is found within `limit`; the time of the search is in `duration`.
  const RecognisedSubject* run(Duration limit, bool is_only_person = true) {
    const Timestamp start = from_ns(1'000'000'000);
    for (Timestamp at = start; at < start + limit; at += kStep) {
      test::update(tracks, tracked);
      stationary.update(tracked, at);
      duration = at - start;
      if (const RecognisedSubject* found = search.step(tracks, stationary, is_only_person, at)) return found;
    }
    return nullptr;
  }

  // The number of labels, each of which must be that of its track.
  std::size_t label_count(const RecognisedSubject& found) const {
    std::size_t count = 0;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      if (!found.track_of_marker[m].names_something()) continue;
      EXPECT_EQ(found.track_of_marker[m], tracked[m].id) << m;
      ++count;
    }
    return count;
  }

  MarkerSet set;
  kinematics::PoseFit truth;
  SubjectSearch search;
  StationaryTracks stationary{LabelSettings{}.still_radius_m};
  LabelledTracks tracks;
  TrackedMarkers tracked;  // by marker
  Duration duration{0};
};

TEST(SubjectSearch, IdentifiesATPoseThatIsHeldForTheSetTime) {
  Search search(false);

  const RecognisedSubject* found = search.run(std::chrono::seconds(2));

  ASSERT_NE(found, nullptr);
  EXPECT_GE(search.duration, LabelSettings{}.still_for);
  EXPECT_TRUE(found->is_newly_fitted);
  for (std::size_t m = 0; m < search.set.markers.size(); ++m)
    EXPECT_EQ(found->track_of_marker[m], search.tracked[m].id) << m;
}

TEST(SubjectSearch, IdentifiesATPoseWithCandidatesForAThirdOfItsMarkers) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  Search search(false);
  for (std::size_t m = 0; m < search.set.markers.size(); m += 3) search.tracked[m].state = TrackState::Candidate;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const Eigen::Vector3d clutter(1.5 * flat(random), 1.5 * flat(random), 1.0 + flat(random));
    search.tracked.push_back(test::detected_track(1000 + i, clutter));
    search.tracked.back().state = TrackState::Candidate;
  }

  const RecognisedSubject* found = search.run(std::chrono::seconds(2));

  ASSERT_NE(found, nullptr);
  for (std::size_t m = 0; m < search.set.markers.size(); ++m)
    EXPECT_EQ(found->track_of_marker[m], search.tracked[m].id) << m;
}

TEST(SubjectSearch, UsesNoCandidateForAFittedBodyInAnyPose) {
  Search search(true);
  for (TrackedMarker& track : search.tracked) track.state = TrackState::Candidate;

  EXPECT_EQ(search.run(std::chrono::seconds(1)), nullptr);
}

TEST(SubjectSearch, IdentifiesAFittedBodyByTentativeTracksOfThreeCameras) {
  for (const std::uint32_t cameras : {2U, 3U}) {
    Search search(true);
    for (TrackedMarker& track : search.tracked) {
      track.state = TrackState::Tentative;
      track.cameras = cameras;
    }

    EXPECT_EQ(search.run(std::chrono::milliseconds(200)) != nullptr, cameras == 3) << cameras;
  }
}

// With two fifths of the markers missed, a search by the measured tracks alone finds nothing.
TEST(SubjectSearch, IdentifiesAFittedBodyByCoastingTracksWhosePositionIsKnown) {
  for (const double sigma_m : {0.003, 0.02}) {
    Search search(true);
    for (std::size_t m = 0; m < search.tracked.size(); ++m) {
      if (m % 5 > 1) continue;
      search.tracked[m].state = TrackState::Coasting;
      search.tracked[m].missed_sets = 1;
      search.tracked[m].covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    }

    const RecognisedSubject* found = search.run(std::chrono::milliseconds(200));

    ASSERT_EQ(found != nullptr, sigma_m < 0.004) << sigma_m;
    if (found == nullptr) continue;
    EXPECT_GE(2 * search.label_count(*found), search.set.markers.size());
  }
}

TEST(SubjectSearch, IdentifiesAFittedBodyInAnotherPose) {
  std::mt19937 random(3);
  Search search(true, test::random_pose(test::person("baseline41"), 0.3, random));

  const RecognisedSubject* found = search.run(std::chrono::seconds(2));

  ASSERT_NE(found, nullptr);
  EXPECT_FALSE(found->is_newly_fitted);
  EXPECT_GE(2 * search.label_count(*found), search.set.markers.size());
}

constexpr LabelSettings kUncalibrated{.search_uncalibrated = true};

TEST(SubjectSearch, IdentifiesABodyThatIsNotFittedInAnotherPose) {
  std::mt19937 random(3);
  Search search(false, test::random_pose(test::person("baseline41"), 0.5, random), kUncalibrated);

  const RecognisedSubject* found = search.run(std::chrono::seconds(4));

  ASSERT_NE(found, nullptr);
  EXPECT_TRUE(found->is_newly_fitted && found->in_any_pose);
  EXPECT_GE(2 * search.label_count(*found), search.set.markers.size());
}

TEST(SubjectSearch, LeavesABodyThatIsNotFittedToTheCalibrationPoseWhileAnotherPersonIsMissing) {
  std::mt19937 random(3);
  Search search(false, test::random_pose(test::person("baseline41"), 0.5, random), kUncalibrated);

  EXPECT_EQ(search.run(std::chrono::seconds(4), false), nullptr);
}

TEST(SubjectSearch, LeavesABodyThatIsNotFittedToTheCalibrationPoseByDefault) {
  std::mt19937 random(3);
  Search search(false, test::random_pose(test::person("baseline41"), 0.5, random));

  EXPECT_EQ(search.run(std::chrono::seconds(4)), nullptr);
}

// The search in any pose has not ended when the T-pose is found.
TEST(SubjectSearch, FindsATPoseDuringASearchInAnyPose) {
  Search search(false, {}, {.search_uncalibrated = true, .search_work = 5});

  const RecognisedSubject* found = search.run(std::chrono::seconds(2));

  ASSERT_NE(found, nullptr);
  EXPECT_FALSE(found->in_any_pose);
  EXPECT_EQ(search.label_count(*found), search.set.markers.size());
}

// The searches for a T-pose meanwhile have one more point, a candidate, before all markers.
TEST(SubjectSearch, KeepsThePointsOfASearchInAnyPoseApartFromThoseOfATPose) {
  std::mt19937 random(3);
  Search search(false, test::random_pose(test::person("baseline41"), 0.5, random),
                {.still_for = std::chrono::milliseconds(1), .search_uncalibrated = true, .search_work = 300});
  const TrackedMarkers markers = search.tracked;
  search.tracked.clear();
  search.tracked.push_back(test::detected_track(1, {2.0, 2.0, 1.0})).state = TrackState::Candidate;
  for (const TrackedMarker& marker : markers) search.tracked.push_back(marker);

  const RecognisedSubject* found = search.run(std::chrono::seconds(8));

  ASSERT_NE(found, nullptr);
  search.tracked = markers;
  EXPECT_GE(2 * search.label_count(*found), search.set.markers.size());
}

// As with a camera that is not synchronised: the sets between have one view, in which no track can be measured.
TEST(SubjectSearch, IdentifiesABodyBetweenSetsThatMeasureNothing) {
  Search search(true);
  TrackedMarkers coasting = search.tracked;
  for (TrackedMarker& track : coasting) track.state = TrackState::Coasting;
  Timestamp at = from_ns(1'000'000'000);
  const RecognisedSubject* found = nullptr;

  for (int set = 0; set < 400 && found == nullptr; ++set, at += kStep) {
    const TrackedMarkers& tracked = set % 3 == 0 ? search.tracked : coasting;
    test::update(search.tracks, tracked);
    search.stationary.update(tracked, at);
    found = search.search.step(search.tracks, search.stationary, true, at);
  }

  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->track_of_marker[0], search.tracked[0].id);
}

TEST(SubjectSearch, GivesUpABodyWhoseTracksAreMissed) {
  Search whole(true);
  ASSERT_NE(whole.run(std::chrono::seconds(2)), nullptr);
  Search search(true);
  ASSERT_EQ(search.run(whole.duration), nullptr);  // all sets but the last, which would identify the body
  ASSERT_TRUE(search.search.busy());

  for (TrackedMarker& track : search.tracked) {
    track.state = TrackState::Coasting;
    track.missed_sets = 1;
  }

  EXPECT_EQ(search.run(kStep), nullptr);
  EXPECT_FALSE(search.search.busy());
}

TEST(SubjectSearch, FindsNothingAmongTracksWithALabel) {
  Search search(true);

  test::update(search.tracks, search.tracked);
  search.stationary.update(search.tracked, from_ns(1'000'000'000));
  search.tracks.labelled.assign(search.tracked.size(), true);

  EXPECT_EQ(search.search.step(search.tracks, search.stationary, true, from_ns(1'000'000'000)), nullptr);
  EXPECT_FALSE(search.search.busy());
}

TEST(SubjectSearch, ComparesBodiesOnlyIfTheyAreFitted) {
  Search search(false);
  const RecognisedSubject* found = search.run(std::chrono::seconds(2));

  ASSERT_NE(found, nullptr);
  EXPECT_FALSE(search.search.residual_cost(*found, search.tracks).has_value());
}

}  // namespace subject_search_test
}  // namespace mocap::label
