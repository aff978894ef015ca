#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "kinematics/pose_fit.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::test {

/// Reads a shipped marker set without the checks of settings/, on which the folders under test must not depend.
MarkerSet person(const std::string& name);

/// Returns a marker set of eighteen markers of baseline41, nearly all on limbs. The left and right markers of thighs,
/// shins and upper arms differ in position by `apart_m`. No pair is declared asymmetric.
MarkerSet sparse_person(double apart_m);

std::size_t bone_named(const MarkerSet& set, const std::string& name);
std::size_t marker_named(const MarkerSet& set, const std::string& name);

/// Angle of the rotation from `b` to `a`, rad.
double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Local poses with random joint rotations within half of their range or `spread_rad`, whichever is less. The root has
/// a random position and yaw.
std::vector<Pose> random_pose(const MarkerSet& set, double spread_rad, std::mt19937& random);

/// Observations of all markers of a pose, without noise.
std::vector<kinematics::Observation> see(const kinematics::PoseFit& truth);

/// The observations except those of `marker`.
std::vector<kinematics::Observation> without(std::vector<kinematics::Observation> seen, std::size_t marker);

}  // namespace mocap::test
