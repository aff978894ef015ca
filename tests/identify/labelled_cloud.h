#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <numeric>
#include <random>
#include <vector>

#include "identify/any_pose_finder.h"
#include "kinematics/pose_fit.h"
#include "support/test_body.h"

namespace mocap::test {

/// Points with their true labels.
struct Cloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> marker_of_point;  ///< -1: clutter
};

/// These markers of a person in a random pose (`random_pose`) in random order, with `ghosts` clutter points.
inline Cloud random_cloud(const MarkerSet& set, std::vector<int> markers, int ghosts, std::mt19937& random,
                          double spread_rad = 1.0) {
  std::normal_distribution<double> normal(0.0, 0.0005);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.set_locals(random_pose(set, spread_rad, random));
  for (int i = 0; i < ghosts; ++i) markers.push_back(-1);
  std::shuffle(markers.begin(), markers.end(), random);
  Cloud cloud;
  for (const int m : markers) {
    Eigen::Vector3d at =
        m < 0 ? Eigen::Vector3d(body.world()[0].position + Eigen::Vector3d(flat(random), flat(random), flat(random)))
              : body.marker_at(static_cast<std::size_t>(m));
    at += Eigen::Vector3d(normal(random), normal(random), normal(random));
    cloud.points.push_back(at);
    cloud.marker_of_point.push_back(m);
  }
  return cloud;
}

/// The same without `hidden` markers.
inline Cloud random_cloud(const MarkerSet& set, int hidden, int ghosts, std::mt19937& random, double spread_rad = 1.0) {
  std::vector<int> markers(set.markers.size());
  std::iota(markers.begin(), markers.end(), 0);
  std::shuffle(markers.begin(), markers.end(), random);
  markers.resize(markers.size() - static_cast<std::size_t>(hidden));
  return random_cloud(set, markers, ghosts, random, spread_rad);
}

struct LabelCounts {
  int right = 0;
  int wrong = 0;
};

inline LabelCounts count_labels(const identify::FoundPose& found, const Cloud& cloud) {
  LabelCounts counts;
  for (std::size_t m = 0; m < found.point_of_marker.size(); ++m) {
    const int p = found.point_of_marker[m];
    if (p < 0) continue;
    const bool right = cloud.marker_of_point[static_cast<std::size_t>(p)] == static_cast<int>(m);
    ++(right ? counts.right : counts.wrong);
  }
  return counts;
}

}  // namespace mocap::test
