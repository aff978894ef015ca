#include "label/subject_labeller.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "label/labelled_person.h"

namespace mocap::label {
namespace subject_labeller_test {

using test::LabelledPerson;

TEST(SubjectLabeller, TracksAnIdentifiedSubject) {
  LabelledPerson person("baseline41");

  ASSERT_TRUE(person.identified);
  EXPECT_TRUE(person.labeller.tracking());
  const SubjectLabels labels = person.labels();
  EXPECT_EQ(labels.phase, SubjectPhase::Tracking);
  for (std::size_t m = 0; m < labels.markers.size(); ++m) {
    EXPECT_EQ(labels.markers[m].state, LabelState::Measured) << m;
    EXPECT_EQ(labels.markers[m].track, person.tracked[m].id) << m;
  }
}

TEST(SubjectLabeller, ReleasesTheLabelOfATrackThatEnded) {
  LabelledPerson person("baseline41");
  const std::size_t wrist = person.marker("LWristIn");
  person.tracked[wrist].id = TrackId{999};  // the marker is detected, but as a new track

  person.predict();

  EXPECT_EQ(person.labels().markers[wrist].state, LabelState::Lost);
}

TEST(SubjectLabeller, PredictsTheMarkersOfABodyAtRestWhereTheyAre) {
  LabelledPerson person("baseline41");

  person.predict();

  for (std::size_t m = 0; m < person.set.markers.size(); ++m) {
    const auto residual = person.labeller.marker_residual(m, person.tracks);
    ASSERT_TRUE(residual.has_value()) << m;
    EXPECT_LT((residual->at - residual->predicted).norm(), 0.001) << m;  // error of the pose fit
  }
}

TEST(SubjectLabeller, LosesASubjectWithoutTracksAfterTheSetTime) {
  LabelledPerson person("baseline41");
  for (std::size_t m = 0; m < person.tracked.size(); ++m) person.tracked[m].id = TrackId{900};
  const Timestamp seen_at = person.at;

  while (person.labeller.tracking() && person.at < seen_at + std::chrono::seconds(2)) {
    person.predict();
    person.labeller.check_loss(person.tracks, person.at);
  }

  EXPECT_EQ(person.labels().phase, SubjectPhase::Lost);
  EXPECT_GT(person.at - seen_at, LabelSettings{}.lost_after);
  EXPECT_LE(person.at - seen_at, LabelSettings{}.lost_after + LabelledPerson::kStep);
}

TEST(SubjectLabeller, ForgetsAllLabels) {
  LabelledPerson person("openmocap18");

  person.labeller.forget();

  const SubjectLabels labels = person.labels();
  EXPECT_EQ(labels.phase, SubjectPhase::Searching);
  EXPECT_TRUE(
      std::ranges::all_of(labels.markers, [](const LabelledMarker& label) { return label.state == LabelState::Lost; }));
}

}  // namespace subject_labeller_test
}  // namespace mocap::label
