#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "bodyfit/fit_subject.h"
#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::functional::test_motion {

/// A take of `markers` markers with places that `place_of(frame, marker)` gives, with noise.
template <class PlaceOf>
bodyfit::LabelledTake take_of(std::size_t frames, std::size_t markers, double noise_m, const PlaceOf& place_of) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, noise_m);
  bodyfit::LabelledTake take{markers, {}};
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t m = 0; m < markers; ++m) {
      const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
      take.places_m.push_back(Eigen::Vector3d(place_of(f, m)) + noise);
    }
  }
  return take;
}

/// A person who turns every joint to and fro, each with a rate of its own, by 70 % of its range but at most 50 degrees
/// about each axis, at 60 Hz.
class Gymnast {
 public:
  explicit Gymnast(const std::string& marker_set)
      : set_(test::person(marker_set)), body_(set_, kinematics::PoseFit::Lengths::Fixed) {}

  const MarkerSet& marker_set() const { return set_; }

  const kinematics::PoseFit& at(std::size_t frame) {
    std::vector<Pose> locals;
    for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
      const Bone& bone = set_.skeleton.bones[b];
      Pose local{bone.rest_offset_m, Eigen::Quaterniond::Identity()};
      Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!bone.rotation_limits[axis]) continue;
        const double rad = (0.6 + 0.11 * static_cast<double>(3 * b + axis)) * static_cast<double>(frame) / 60.0;
        const double wave = std::sin(rad);
        const double reach = wave > 0.0 ? bone.rotation_limits[axis]->max_rad : -bone.rotation_limits[axis]->min_rad;
        rotation_rad[static_cast<Eigen::Index>(axis)] = wave * std::clamp(0.7 * reach, 0.0, 0.87);
      }
      if (bone.parent < 0) local.position = {0.0, 0.0, 1.0};
      local.rotation = kinematics::from_rotation_vector(rotation_rad);
      locals.push_back(local);
    }
    body_.set_locals(locals);
    return body_;
  }

  bodyfit::LabelledTake take(std::size_t frames, double noise_m) {
    return take_of(frames, set_.markers.size(), noise_m, [&](std::size_t f, std::size_t m) {
      if (m == 0) (void)at(f);
      return body_.marker_at(m);
    });
  }

 private:
  MarkerSet set_;
  kinematics::PoseFit body_;
};

}  // namespace mocap::functional::test_motion
