#include "solve/subject_refiner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "solve/tree_solver.h"
#include "support/test_body.h"

namespace mocap::solve {
namespace {

using kinematics::PoseFit;

constexpr double kRate_hz = 120.0;

/// Somebody whose bones are up to 12 % and whose markers up to 20 mm off the file's, seen with 0.2 mm of noise.
class Somebody {
 public:
  Somebody(const MarkerSet& file, unsigned seed, double arms_lowered_rad)
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

  /// Stands for a second, then moves from pose to pose.
  void at(int set) {
    const int since = set - static_cast<int>(kRate_hz);
    if (since >= 0 && since % kSetsAPose == 0) {
      from_ = to_;
      to_ = test::random_pose(body_.marker_set(), 0.6, random_);
      to_[0].position = 0.3 * to_[0].position + Eigen::Vector3d(0.0, 0.0, 0.7);
    }
    double share = since < 0 ? 0.0 : (since % kSetsAPose + 1.0) / kSetsAPose;
    share = share * share * (3.0 - 2.0 * share);
    std::vector<Pose> locals = to_;
    for (std::size_t b = 0; b < to_.size(); ++b) {
      locals[b].rotation = from_[b].rotation.slerp(share, to_[b].rotation);
      locals[b].position = (1.0 - share) * from_[b].position + share * to_[b].position;
    }
    body_.set_locals(locals);
  }

  Labels seen() {
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
  static constexpr int kSetsAPose = 60;

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

// As it is known when it was just recognised: bones of the right size, markers where the file has them.
SubjectFit recognised(const MarkerSet& file, const MarkerSet& truth) {
  SubjectFit fit;
  fit.subject = SubjectId{0};
  const double size = truth.skeleton.bones[1].rest_offset_m.norm() / file.skeleton.bones[1].rest_offset_m.norm();
  for (const Bone& bone : file.skeleton.bones) fit.rest_offsets_m.push_back(size * bone.rest_offset_m);
  for (const MarkerOnBone& marker : file.markers) fit.marker_offsets_m.push_back(size * marker.offset_m);
  return fit;
}

// Markers tell all of these joints' place and turn.
bool told(const std::string& bone) {
  return bone != "Hips" && bone != "Neck" && !bone.ends_with("Hand") && !bone.ends_with("Foot");
}

struct Errors {
  double joints_m2 = 0.0, turns_rad2 = 0.0;
  int count = 0;

  void add(const SubjectPose& shown, const PoseFit& truth) {
    for (std::size_t b = 0; b < shown.bones.size(); ++b) {
      if (!told(truth.marker_set().skeleton.bones[b].name)) continue;
      joints_m2 += (shown.bones[b].world_from_bone.position - truth.world()[b].position).squaredNorm();
      turns_rad2 +=
          std::pow(test::angle_between(shown.bones[b].world_from_bone.rotation, truth.world()[b].rotation), 2);
      ++count;
    }
  }
  double joint_rms_m() const { return std::sqrt(joints_m2 / count); }
  double turn_rms_rad() const { return std::sqrt(turns_rad2 / count); }
};

struct Course {
  Errors before, after;   // of the first and of the last second of the motion
  std::vector<int> fits;  // sets after which one was given
};

Course track(const std::string& name, unsigned seed, int sets, const RefineSettings& settings,
             double arms_lowered_rad = 0.0) {
  const MarkerSet file = test::person(name);
  const std::vector<Subject> subjects{{"somebody", file}};
  Somebody somebody(file, seed, arms_lowered_rad);
  const auto solver = make_skeleton_solver({}, subjects);
  SubjectRefiner refiner(settings, subjects);
  Course run;
  for (int set = 0; set < sets; ++set) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(set / kRate_hz);
    somebody.at(set);
    Labels labels = somebody.seen();
    if (set == 0) {
      const SubjectFit fit = recognised(file, somebody.body().marker_set());
      solver->refit(fit);
      refiner.recognised(fit);
    }
    const Poses& poses = solver->solve(labels, at);
    const int second = static_cast<int>(kRate_hz);
    if (set > second && set <= 2 * second) run.before.add(poses[0], somebody.body());
    if (set >= sets - 2 * second) run.after.add(poses[0], somebody.body());
    if (const auto fit = refiner.step(labels, poses, at)) {
      run.fits.push_back(set);
      solver->refit(*fit);
    }
  }
  return run;
}

TEST(RefineSubject, BringsJointsWithinThreeMillimetresWhileTracking) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Course run = track("baseline41", seed, 2400, {});

    EXPECT_LT(run.after.joint_rms_m(), 0.003);
    EXPECT_LT(run.after.turn_rms_rad(), 0.0175);
    EXPECT_LE(run.fits.size(), 10U);
  }
}

TEST(RefineSubject, DoesNotTakeTheArmsOfAnAPoseForArmsAtRest) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Course run = track("baseline41", seed, 240, {}, 0.785);

    // Markers are 2 cm off, and few poses were seen yet. Arms that were held for straight would be off by twice that.
    EXPECT_LT(run.after.joint_rms_m(), 0.02);
    EXPECT_LT(run.after.turn_rms_rad(), 0.12);
  }
}

TEST(RefineSubject, GivesTheSameFitsForTheSameSets) {
  EXPECT_EQ(track("baseline41", 5, 900, {}).fits, track("baseline41", 5, 900, {}).fits);
}

}  // namespace
}  // namespace mocap::solve
