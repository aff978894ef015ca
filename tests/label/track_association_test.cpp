#include "label/track_association.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "label/labelled_person.h"

namespace mocap::label {
namespace track_association_test {

using test::LabelledPerson;

// One set: prediction and association of one person.
void associate(LabelledPerson& person) {
  person.predict();
  std::vector<SubjectLabeller> subjects;
  subjects.push_back(std::move(person.labeller));
  TrackAssociation association(person.set.markers.size());
  association.associate(subjects, person.tracks);
  person.labeller = std::move(subjects[0]);
}

TEST(TrackAssociation, KeepsTheLabelsOfABodyAtRest) {
  LabelledPerson person("baseline41");

  associate(person);

  const SubjectLabels labels = person.labels();
  for (std::size_t m = 0; m < labels.markers.size(); ++m) EXPECT_EQ(labels.markers[m].track, person.tracked[m].id) << m;
}

TEST(TrackAssociation, ReassignsTwoTracksThatExchangedTheirMarkers) {
  LabelledPerson person("openmocap18");
  const std::size_t left = person.marker("LeftUpLeg");
  const std::size_t right = person.marker("RightUpLeg");
  std::swap(person.tracked[left].id, person.tracked[right].id);

  associate(person);

  EXPECT_EQ(person.labels().markers[left].track, person.tracked[left].id);
  EXPECT_EQ(person.labels().markers[right].track, person.tracked[right].id);
}

TEST(TrackAssociation, GivesAMarkerThatReappearsItsLabel) {
  LabelledPerson person("openmocap18");
  const std::size_t foot = person.marker("LeftFoot");
  person.tracked[foot].id = TrackId{999};

  associate(person);

  EXPECT_EQ(person.labels().markers[foot].track, TrackId{999});
}

TEST(TrackAssociation, GivesNoLabelToATrackOutsideTheGate) {
  LabelledPerson person("openmocap18");
  const std::size_t foot = person.marker("LeftFoot");
  person.tracked[foot] = test::detected_track(999, person.truth.marker_at(foot) + Eigen::Vector3d(0.3, 0.0, 0.0));

  associate(person);

  EXPECT_EQ(person.labels().markers[foot].state, LabelState::Lost);
}

}  // namespace track_association_test
}  // namespace mocap::label
