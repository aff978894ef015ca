#include "solve/subject_refiner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "kinematics/rotation.h"
#include "solve/tree_solver.h"
#include "support/archived.h"
#include "support/test_body.h"

namespace mocap::solve {
namespace subject_refiner_test {

using kinematics::PoseFit;

constexpr double kRate_hz = 120.0;

/// A person whose bones differ from the marker set file by up to 12 % and whose markers by up to 20 mm. Measured with
/// 0.2 mm of noise; fixed seed.
class Person {
 public:
  Person(const MarkerSet& file, unsigned seed, double arms_lowered_rad)
      : random_(seed), body_(other(file), PoseFit::Lengths::Fixed) {
    from_.assign(body_.locals().begin(), body_.locals().end());
    from_[0].position.z() = 1.0;
    const auto& bones = file.skeleton.bones;
    for (std::size_t b = 0; b < bones.size(); ++b) {
      if (bones[b].name == "LeftUpArm")
        from_[b].rotation = kinematics::from_rotation_vector({-arms_lowered_rad, 0.0, 0.0});
      if (bones[b].name == "RightUpArm")
        from_[b].rotation = kinematics::from_rotation_vector({arms_lowered_rad, 0.0, 0.0});
    }
    to_ = from_;
  }

  /// Sets the true pose: one second in the first pose, then from random pose to random pose, each within half a second.
  void at(int set) {
    const int since = set - static_cast<int>(kRate_hz);
    if (since >= 0 && since % kSetsPerPose == 0) {
      from_ = to_;
      to_ = test::random_pose(body_.marker_set(), 0.6, random_);
      to_[0].position = 0.3 * to_[0].position + Eigen::Vector3d(0.0, 0.0, 0.7);
    }
    double share = since < 0 ? 0.0 : (since % kSetsPerPose + 1.0) / kSetsPerPose;
    share = share * share * (3.0 - 2.0 * share);
    std::vector<Pose> locals = to_;
    for (std::size_t b = 0; b < to_.size(); ++b) {
      locals[b].rotation = from_[b].rotation.slerp(share, to_[b].rotation);
      locals[b].position = (1.0 - share) * from_[b].position + share * to_[b].position;
    }
    body_.set_locals(locals);
  }

  Labels measured_labels() {
    std::normal_distribution<double> normal(0.0, 0.0002);
    Labels labels;
    labels.push_back({SubjectId{0}, SubjectPhase::Tracking, {}});
    for (std::size_t m = 0; m < body_.marker_set().markers.size(); ++m) {
      LabelledMarker& label = labels[0].markers.push_back({});
      label.state = LabelState::Measured;
      label.position.v = body_.marker_at(m) + Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
      label.covariance_m2 = 4e-8 * Eigen::Matrix3d::Identity();
      label.cameras = 4;
    }
    return labels;
  }

  const PoseFit& body() const { return body_; }

 private:
  static constexpr int kSetsPerPose = 60;

  MarkerSet other(const MarkerSet& file) {
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    MarkerSet set = file;
    const double size = 1.0 + 0.07 * flat(random_);
    for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= size * (1.0 + 0.05 * flat(random_));
    for (MarkerOnBone& marker : set.markers)
      marker.offset_m += 0.0115 * Eigen::Vector3d(flat(random_), flat(random_), flat(random_));
    return set;
  }

  std::mt19937 random_;
  PoseFit body_;
  std::vector<Pose> from_, to_;
};

// Body model after the identification: bones and markers of the file, scaled to the size of the person.
SubjectFit just_identified(const MarkerSet& file, const MarkerSet& truth) {
  SubjectFit fit;
  fit.subject = SubjectId{0};
  const double size = truth.skeleton.bones[1].rest_offset_m.norm() / file.skeleton.bones[1].rest_offset_m.norm();
  for (const Bone& bone : file.skeleton.bones) fit.rest_offsets_m.push_back(size * bone.rest_offset_m);
  for (const MarkerOnBone& marker : file.markers) fit.marker_offsets_m.push_back(size * marker.offset_m);
  return fit;
}

// Whether markers determine position and rotation of the joint.
bool is_observed(const std::string& bone) {
  return bone != "Hips" && bone != "Neck" && !bone.ends_with("Hand") && !bone.ends_with("Foot");
}

struct Errors {
  double joints_m2 = 0.0, rotations_rad2 = 0.0;
  int count = 0;

  void add(const SubjectPose& published, const PoseFit& truth) {
    for (std::size_t b = 0; b < published.bones.size(); ++b) {
      if (!is_observed(truth.marker_set().skeleton.bones[b].name)) continue;
      joints_m2 += (published.bones[b].world_from_bone.position - truth.world()[b].position).squaredNorm();
      rotations_rad2 +=
          std::pow(test::angle_between(published.bones[b].world_from_bone.rotation, truth.world()[b].rotation), 2);
      ++count;
    }
  }
  double joint_rms_m() const { return std::sqrt(joints_m2 / count); }
  double rotation_rms_rad() const { return std::sqrt(rotations_rad2 / count); }
};

struct TrackingRun {
  Errors before, after;   // in the first and in the last second of the motion
  std::vector<int> fits;  // sets in which a body model was adopted
};

TrackingRun track(const std::string& name, unsigned seed, int sets, const RefineSettings& settings,
                  double arms_lowered_rad = 0.0, bool in_any_pose = false) {
  const MarkerSet file = test::person(name);
  const std::vector<Subject> subjects{{"somebody", file}};
  Person person(file, seed, arms_lowered_rad);
  const auto solver = make_skeleton_solver({}, subjects);
  SubjectRefiner refiner(settings, subjects);
  TrackingRun run;
  for (int set = 0; set < sets; ++set) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
    person.at(set);
    const Labels measured = person.measured_labels();
    if (set == 0) {
      SubjectFit fit = just_identified(file, person.body().marker_set());
      fit.in_any_pose = in_any_pose;
      solver->refit(fit);
      refiner.recognised(fit);
    }
    const auto& [labels, poses] = solver->solve(measured, at);
    const int second = static_cast<int>(kRate_hz);
    if (set > second && set <= 2 * second) run.before.add(poses[0], person.body());
    if (set >= sets - 2 * second) run.after.add(poses[0], person.body());
    if (const auto fit = refiner.step(labels, poses, at)) {
      run.fits.push_back(set);
      solver->refit(*fit);
    }
  }
  return run;
}

TEST(SubjectRefiner, ReducesJointErrorsBelowThreeMillimetresWhileTracking) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const TrackingRun run = track("baseline41", seed, 2400, {});

    EXPECT_LT(run.after.joint_rms_m(), 0.003);
    EXPECT_LT(run.after.rotation_rms_rad(), 0.0175);
    EXPECT_LE(run.fits.size(), 10U);
  }
}

TEST(SubjectRefiner, DoesNotAssumeThatTheArmsOfAnAPoseAreAtRest) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const TrackingRun run = track("baseline41", seed, 240, {}, 0.785);

    // Markers are 2 cm off and few poses are stored. Arms that are mistaken for straight would add twice that error.
    EXPECT_LT(run.after.joint_rms_m(), 0.02);
    EXPECT_LT(run.after.rotation_rms_rad(), 0.12);
  }
}

// The body is near the rest pose, but nobody said that it is in it.
TEST(SubjectRefiner, DoesNotFitABodyThatWasIdentifiedInAnyPoseToTheRestPose) {
  EXPECT_FALSE(track("baseline41", 1, 120, {}, 0.0).fits.empty());
  EXPECT_TRUE(track("baseline41", 1, 120, {}, 0.0, true).fits.empty());
}

/// Displaces markers as skin does: 8 mm rms, half of the variance common to the markers of a bone, with a memory of
/// 0.2 s.
class Skin {
 public:
  Skin(const MarkerSet& set, unsigned seed)
      : set_(set),
        random_(seed),
        bones_m_(set.skeleton.bones.size(), Eigen::Vector3d::Zero()),
        markers_m_(set.markers.size(), Eigen::Vector3d::Zero()) {}

  void displace(Labels& labels) {
    for (Eigen::Vector3d& bone_m : bones_m_) step(bone_m);
    for (std::size_t m = 0; m < markers_m_.size(); ++m) {
      step(markers_m_[m]);
      labels[0].markers[m].position.v += markers_m_[m] + bones_m_[static_cast<std::size_t>(set_.markers[m].bone)];
    }
  }

 private:
  void step(Eigen::Vector3d& displacement_m) {
    static constexpr double kSigma_m = 0.0033;  // of each axis and each of the two parts
    const double kept = std::exp(-1.0 / (0.2 * kRate_hz));
    std::normal_distribution<double> normal(0.0, kSigma_m * std::sqrt(1.0 - kept * kept));
    displacement_m = kept * displacement_m + Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
  }

  const MarkerSet& set_;
  std::mt19937 random_;
  std::vector<Eigen::Vector3d> bones_m_, markers_m_;
};

TEST(SubjectRefiner, KeepsATrueBodyWhereSkinHasAMemory) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Person person(test::person("baseline41"), seed, 0.0);
    const std::vector<Subject> subjects{{"somebody", person.body().marker_set(), true}};
    Skin skin(person.body().marker_set(), seed);
    const auto solver = make_skeleton_solver({}, subjects);
    SubjectRefiner refiner({}, subjects);
    for (int set = 0; set < 2400; ++set) {
      const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
      person.at(set);
      Labels measured = person.measured_labels();
      skin.displace(measured);
      const auto& [labels, poses] = solver->solve(measured, at);
      EXPECT_FALSE(refiner.step(labels, poses, at)) << "seed " << seed << ", set " << set;
    }
  }
}

// The fit to the rest pose is in work when the subject is reset.
TEST(SubjectRefiner, GivesNoFitOfASubjectThatWasReset) {
  const MarkerSet file = test::person("baseline41");
  const std::vector<Subject> subjects{{"somebody", file}};
  Person person(file, 5, 0.0);
  const auto solver = make_skeleton_solver({}, subjects);
  SubjectRefiner refiner({}, subjects);
  const SubjectFit identified = just_identified(file, person.body().marker_set());
  solver->refit(identified);
  refiner.recognised(identified);
  for (int set = 0; set < 480; ++set) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
    person.at(set);
    const auto& [labels, poses] = solver->solve(person.measured_labels(), at);
    EXPECT_FALSE(refiner.step(labels, poses, at)) << set;
    if (set == 3) refiner.forget(SubjectId{0});
  }
}

// Another person wears the markers of a subject whose bones are known.
TEST(SubjectRefiner, FitsABodyThatWasFittedAtAnIdentificationAsIfItWasUnknown) {
  const MarkerSet file = test::person("baseline41");
  Person person(file, 5, 0.0);
  const std::vector<Subject> unknown{{"somebody", file}}, known{{"somebody", file, true}};
  const auto solver = make_skeleton_solver({}, unknown);
  SubjectRefiner of_unknown({}, unknown), of_known({}, known);
  SubjectFit identified = just_identified(file, person.body().marker_set());
  identified.at_identification = true;
  solver->refit(identified);
  of_unknown.recognised(identified);
  of_known.recognised(identified);
  int fits = 0;
  for (int set = 0; set < 360; ++set) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
    person.at(set);
    const auto& [labels, poses] = solver->solve(person.measured_labels(), at);
    std::optional<SubjectFit> fit = of_unknown.step(labels, poses, at), twin = of_known.step(labels, poses, at);
    ASSERT_EQ(test::archived(of_unknown), test::archived(of_known)) << set;
    if (!fit) continue;
    EXPECT_EQ(test::archived(*fit), test::archived(*twin)) << set;
    solver->refit(*fit);
    ++fits;
  }
  EXPECT_GE(fits, 1);

  // The belief has the knowledge about the bones.
  SubjectRefiner other({}, known);
  ASSERT_TRUE(test::take_over(test::archived(of_known), other));
  EXPECT_EQ(test::archived(other), test::archived(of_known));
}

TEST(SubjectRefiner, KnowsNoBonesOfAnotherPersonWhenItsSettingsChange) {
  const MarkerSet file = test::person("baseline41");
  const Person person(file, 5, 0.0);
  const std::vector<Subject> unknown{{"somebody", file}}, known{{"somebody", file, true}};
  SubjectRefiner of_unknown({}, unknown), of_known({}, known);
  SubjectFit identified = just_identified(file, person.body().marker_set());
  identified.at_identification = true;
  of_unknown.recognised(identified);
  of_known.recognised(identified);

  const RefineSettings changed{.least_gain = 0.05};
  SubjectRefiner after_unknown(changed, unknown), after_known(changed, known);
  const Handover handover{.subjects = {SubjectId{0}}, .cameras = {}};
  after_unknown.adopt(of_unknown, handover);
  after_known.adopt(of_known, handover);

  EXPECT_EQ(test::archived(after_known), test::archived(after_unknown));
}

TEST(SubjectRefiner, GivesTheSameFitsForTheSameSets) {
  EXPECT_EQ(track("baseline41", 5, 900, {}).fits, track("baseline41", 5, 900, {}).fits);
}

// A refiner that is replaced after each set by a new one with its belief gives the same fits: in each stage of a fit.
TEST(SubjectRefiner, ContinuesFromItsArchiveAfterEachSet) {
  const MarkerSet file = test::person("baseline41");
  const std::vector<Subject> subjects{{"somebody", file}, {"nobody", file}};
  Person person(file, 5, 0.0);
  const auto solver = make_skeleton_solver({}, subjects);
  SubjectRefiner refiner({}, subjects);
  auto other = std::make_unique<SubjectRefiner>(RefineSettings{}, subjects);
  const SubjectFit identified = just_identified(file, person.body().marker_set());
  solver->refit(identified);
  refiner.recognised(identified);
  other->recognised(identified);
  int fits = 0;
  for (int set = 0; set < 900; ++set) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
    person.at(set);
    const auto& [labels, poses] = solver->solve(person.measured_labels(), at);
    std::optional<SubjectFit> fit = refiner.step(labels, poses, at);
    std::optional<SubjectFit> twin = other->step(labels, poses, at);
    ASSERT_EQ(fit.has_value(), twin.has_value()) << set;
    const std::vector<std::byte> belief = test::archived(refiner);
    ASSERT_EQ(belief, test::archived(*other)) << set;
    if (fit) {
      EXPECT_EQ(test::archived(*fit), test::archived(*twin)) << set;
      solver->refit(*fit);
      ++fits;
    }
    other = std::make_unique<SubjectRefiner>(RefineSettings{}, subjects);
    ASSERT_TRUE(test::take_over(belief, *other)) << set;
  }
  EXPECT_GE(fits, 2);
}

}  // namespace subject_refiner_test
}  // namespace mocap::solve
