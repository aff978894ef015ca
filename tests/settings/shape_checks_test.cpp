#include <gmock/gmock.h>

#include "identify/asymmetry.h"
#include "settings/subject/shape_checks.h"
#include "support/test_body.h"

namespace mocap::settings {
namespace shape_checks_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

DaemonSettings with_subject(const MarkerSet& set, bool fitted) {
  DaemonSettings settings;
  settings.subjects = {{.name = "anna", .marker_set_file = "sparse.toml", .file = {}, .keep = {}}};
  settings.subject_models = {{"anna", set, fitted}};
  return settings;
}

TEST(ShapeWarnings, NameTheFileAndThePairsThatWouldDistinguishTheSides) {
  EXPECT_THAT(shape_warnings(with_subject(test::sparse_person(0.0), false)),
              ElementsAre(AllOf(HasSubstr("front and back of subject 'anna' in T-pose are exchanged"),
                                HasSubstr("move one marker of each of these pairs"),
                                HasSubstr(R"(asymmetric = [["LThigh", "RThigh"], ["LKneeOut", "RKneeOut"], )"
                                          R"(["LShin", "RShin"]], in sparse.toml)"))));
}

TEST(ShapeWarnings, AreAbsentForAFittedBodyOrACompleteSet) {
  EXPECT_THAT(shape_warnings(with_subject(test::sparse_person(0.0), true)), IsEmpty());
  EXPECT_THAT(shape_warnings(with_subject(test::person("baseline41"), false)), IsEmpty());
  EXPECT_THAT(shape_warnings(with_subject(test::person("rigid4"), false)), IsEmpty());
}

TEST(ShapeWarnings, EndWithPairsThatDistinguishTheSides) {
  MarkerSet set = test::sparse_person(0.04);
  EXPECT_THAT(
      shape_warnings(with_subject(set, false)),
      ElementsAre(HasSubstr("list the pairs that are no mirror images of each other seen from the front: asymmetric = "
                            R"([["LUArmHigh", "RUArmHigh"], ["LThigh", "RThigh"], ["LShin", "RShin"]])")));

  set.asymmetric = identify::asymmetric_markers(set);
  EXPECT_THAT(shape_warnings(with_subject(set, false)), IsEmpty());
}

}  // namespace shape_checks_test
}  // namespace mocap::settings
