#include "bodyfit/fit_subject.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "bodyfit/subject_fitter.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::bodyfit {
namespace fit_subject_test {

using test::angle_between;
using test::person;
using test::random_pose;

// A body with other bone lengths than the file; each marker is moved by up to `shift_m`.
MarkerSet random_body(const MarkerSet& file, std::mt19937& random, double stretch, double shift_m) {
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  MarkerSet other = file;
  const double size = 1.0 + 0.6 * stretch * flat(random);
  for (std::size_t b = 1; b < other.skeleton.bones.size(); ++b) {
    other.skeleton.bones[b].rest_offset_m *= size * (1.0 + 0.4 * stretch * flat(random));
  }
  for (MarkerOnBone& marker : other.markers) {
    Eigen::Vector3d shift;
    do {
      shift = {flat(random), flat(random), flat(random)};
    } while (shift.norm() > 1.0);
    marker.offset_m += shift_m * shift;
  }
  return other;
}

struct Take {
  LabelledTake seen;
  std::vector<std::vector<Pose>> locals;
};

void add(const kinematics::PoseFit& body, double noise_m, std::mt19937& random, Take& take) {
  std::normal_distribution<double> normal(0.0, noise_m);
  take.seen.markers = body.marker_set().markers.size();
  for (std::size_t m = 0; m < take.seen.markers; ++m) {
    take.seen.places_m.push_back(body.marker_at(m) + Eigen::Vector3d(normal(random), normal(random), normal(random)));
  }
  take.locals.emplace_back(body.locals().begin(), body.locals().end());
}

// 30 frames in T-pose with the heading `yaw_rad`.
Take rest_take(const MarkerSet& set, double yaw_rad, double noise_m, std::mt19937& random) {
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.place({{0.3, -0.2, 0.95}, kinematics::from_rotation_vector({0.0, 0.0, yaw_rad})});
  Take take;
  for (int i = 0; i < 30; ++i) add(body, noise_m, random, take);
  return take;
}

// Moves from one random pose to the next at constant speed, in 25 frames each.
Take motion_take(const MarkerSet& set, int poses, double spread_rad, double noise_m, std::mt19937& random) {
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<Pose> from(body.locals().begin(), body.locals().end());
  Take take;
  for (int i = 0; i < poses; ++i) {
    const std::vector<Pose> to = random_pose(set, spread_rad, random);
    for (int step = 1; step <= 25; ++step) {
      const double share = step / 25.0;
      std::vector<Pose> locals = to;
      for (std::size_t b = 0; b < to.size(); ++b) {
        locals[b].rotation = from[b].rotation.slerp(share, to[b].rotation);
        locals[b].position = (1.0 - share) * from[b].position + share * to[b].position;
      }
      body.set_locals(locals);
      add(body, noise_m, random, take);
    }
    from = to;
  }
  return take;
}

struct Errors {
  double joint_rms_m = 0.0;
  double rotation_rms_rad = 0.0;
  double offset_rms_m = 0.0;
};

// Whether markers observe the rotation of a bone and the position of its joint. They do not for the root (its joint is
// a convention), a hand or foot with few markers (unobserved twist) and a neck without markers.
bool is_observable(const MarkerSet& set, std::size_t bone) {
  const std::string& name = set.skeleton.bones[bone].name;
  return name != "Hips" && name != "Neck" && !name.ends_with("Hand") && !name.ends_with("Foot");
}

// Errors of a fitted body on a motion that was not part of the fit.
Errors errors_of(const MarkerSet& fitted, const MarkerSet& truth, const Take& motion) {
  kinematics::PoseFit estimated(fitted, kinematics::PoseFit::Lengths::Fixed),
      real(truth, kinematics::PoseFit::Lengths::Fixed);
  double joints = 0.0, rotations = 0.0;
  int count = 0;
  for (std::size_t f = 0; f < motion.seen.frames(); f += 10) {
    real.set_locals(motion.locals[f]);
    estimated.set_locals(motion.locals[f]);
    std::vector<kinematics::Observation> seen;
    for (std::size_t m = 0; m < motion.seen.markers; ++m)
      seen.push_back({static_cast<int>(m), motion.seen.frame(f)[m], 0.001});
    (void)estimated.solve(seen, {}, 30);
    for (std::size_t b = 0; b < truth.skeleton.bones.size(); ++b) {
      if (!is_observable(truth, b)) continue;
      joints += (estimated.world()[b].position - real.world()[b].position).squaredNorm();
      rotations += std::pow(angle_between(estimated.world()[b].rotation, real.world()[b].rotation), 2);
      ++count;
    }
  }
  Errors errors;
  errors.joint_rms_m = std::sqrt(joints / count);
  errors.rotation_rms_rad = std::sqrt(rotations / count);
  double sum = 0.0;
  int markers = 0;
  for (std::size_t m = 0; m < truth.markers.size(); ++m) {
    if (!is_observable(truth, static_cast<std::size_t>(truth.markers[m].bone))) continue;
    sum += (fitted.markers[m].offset_m - truth.markers[m].offset_m).squaredNorm();
    ++markers;
  }
  errors.offset_rms_m = std::sqrt(sum / markers);
  return errors;
}

TEST(InstantEquations, GradientOfTheOffsetsAgreesWithFiniteDifferences) {
  const MarkerSet file = person("baseline41");
  std::mt19937 random(11);
  const MarkerSet truth = random_body(file, random, 0.1, 0.01);
  const Take take = motion_take(truth, 1, 0.5, 0.001, random);
  BodyInstant instant = empty_instant(file);
  const auto frame = take.seen.frame(take.seen.frames() - 1);
  instant.seen_m.assign(frame.begin(), frame.end());
  instant.seen_m[7].setConstant(std::nan(""));
  instant.trust[9] = 0.3;
  instant.locals = take.locals.back();
  instant.at_rest[5] = 1;
  // A large outlier scale gives all markers about the same weight. With a small scale, a marker near it makes the
  // optimisation of the pose converge slowly.
  const InstantCost by{.outlier_m = 1.0, .at_rest_sigma_rad = 0.3};
  InstantEquations equations(file);
  const BodyOffsets offsets = offsets_of(file);
  (void)equations.optimise_pose(instant, offsets, by, 400);
  const auto count = static_cast<std::size_t>(equations.columns().count);
  std::vector<double> matrix(count * count), gradient(count);
  (void)equations.eliminate(instant, offsets, by);
  for (std::size_t part = 0; part < equations.parts(); ++part) equations.add_to(part, matrix, gradient);

  const auto cost_at = [&](const BodyOffsets& moved) {
    BodyInstant again = instant;
    return equations.optimise_pose(again, moved, by, 400).cost(by);
  };
  constexpr double kStep_m = 1e-5;
  const auto check = [&](int column, const auto& place) {
    for (int axis = 0; axis < 3; ++axis) {
      BodyOffsets more = offsets, less = offsets;
      place(more)[axis] += kStep_m;
      place(less)[axis] -= kStep_m;
      const double slope = (cost_at(more) - cost_at(less)) / (2.0 * kStep_m);
      // The cost is about 100 with a relative precision of 1e-10, the step is 1e-5 m: the slope is exact to about 0.01.
      // The gradient is half the derivative of the cost.
      EXPECT_NEAR(0.5 * slope, gradient[static_cast<std::size_t>(column + axis)], 0.05 + 1e-3 * std::abs(slope));
    }
  };
  for (const std::size_t b : {1U, 3U, 5U, 6U, 10U}) {
    check(equations.columns().bone[b], [b](BodyOffsets& o) -> Eigen::Vector3d& { return o.bones_m[b]; });
  }
  for (const std::size_t m : {0U, 7U, 9U, 14U, 25U}) {
    check(equations.columns().marker[m], [m](BodyOffsets& o) -> Eigen::Vector3d& { return o.markers_m[m]; });
  }
}

class FitSubject : public ::testing::TestWithParam<const char*> {};

TEST_P(FitSubject, FindsJointsAndMarkersFromARangeOfMotion) {
  const MarkerSet file = person(GetParam());
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(seed);
    const MarkerSet truth = random_body(file, random, 0.15, std::string(GetParam()) == "openmocap18" ? 0.0 : 0.02);
    const Take rest = rest_take(truth, 0.7 * seed, 0.0002, random);
    const Take motion = motion_take(truth, 60, 0.6, 0.0002, random);
    const Take unseen = motion_take(truth, 12, 0.6, 0.0002, random);

    const auto from_rest = fit_subject(file, rest.seen, {}, {});
    const auto fitted = fit_subject(file, rest.seen, motion.seen, {});

    ASSERT_TRUE(from_rest && fitted);
    const Errors errors = errors_of(fitted->marker_set, truth, unseen);
    // Control: a fit to the T-pose alone cannot separate the joints from markers that are 20 mm off.
    EXPECT_LT(errors.joint_rms_m, std::max(0.0015, 0.3 * errors_of(from_rest->marker_set, truth, unseen).joint_rms_m));
    EXPECT_LT(errors.joint_rms_m, 0.002);
    EXPECT_LT(fitted->residuals.rms_m, 0.0005);              // the noise is 0.35 mm (three axes of 0.2 mm)
    if (std::string(GetParam()) == "openmocap18") continue;  // its markers do not observe any twist
    EXPECT_LT(errors.rotation_rms_rad, 0.03);
    EXPECT_LT(errors.offset_rms_m, 0.004);
  }
}

INSTANTIATE_TEST_SUITE_P(ShippedSets, FitSubject, ::testing::Values("openmocap18", "baseline41", "pluginGait39"),
                         [](const auto& set) { return std::string(set.param); });

// Displaces the markers of each bone together, by a new vector in each frame.
void move_skin(const MarkerSet& set, double sigma_m, std::mt19937& random, Take& take) {
  std::normal_distribution<double> normal(0.0, sigma_m);
  std::vector<Eigen::Vector3d> moved(set.skeleton.bones.size());
  for (std::size_t frame = 0; frame < take.seen.frames(); ++frame) {
    for (Eigen::Vector3d& each : moved) each = {normal(random), normal(random), normal(random)};
    for (std::size_t m = 0; m < take.seen.markers; ++m) {
      take.seen.places_m[frame * take.seen.markers + m] += moved[static_cast<std::size_t>(set.markers[m].bone)];
    }
  }
}

TEST(FitSubject, KeepsTheJointsWhereTheSkinOfABoneMovesAsAWhole) {
  const MarkerSet file = person("baseline41");
  std::mt19937 random(5);
  const MarkerSet truth = random_body(file, random, 0.1, 0.01);
  Take rest = rest_take(truth, 0.4, 0.002, random), motion = motion_take(truth, 20, 0.25, 0.002, random);
  const Take judged = motion_take(truth, 8, 0.25, 0.0, random);
  move_skin(truth, 0.004, random, rest);
  move_skin(truth, 0.004, random, motion);

  const auto fit = fit_subject(file, rest.seen, motion.seen, {});

  ASSERT_TRUE(fit);
  const Errors errors = errors_of(fit->marker_set, truth, judged);
  // 8.8 mm; 17.7 mm with common_variance = 0, that is, with independent markers.
  EXPECT_LT(errors.joint_rms_m, 0.012);
}

}  // namespace fit_subject_test
}  // namespace mocap::bodyfit
