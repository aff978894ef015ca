#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"
#include "solve/tree_solver.h"
#include "support/test_body.h"

namespace mocap::test {

constexpr double kStep_s = 1.0 / 120.0;

/// A simulated person with correct labels, and a solver. A test selects the markers that are measured. Truth by forward
/// kinematics; 120 sets a second; fixed seed.
class SolveWorld {
 public:
  explicit SolveWorld(const std::string& name, const solve::SolveSettings& settings = {})
      : set_(person(name)),
        solver_(solve::make_skeleton_solver(settings, {{"actor", set_, true}})),
        truth_(set_.skeleton.bones.size()),
        shows_(set_.markers.size(), true) {
    labels_.resize(1);
    labels_[0].subject = SubjectId{0};
    labels_[0].phase = SubjectPhase::Tracking;
  }

  std::size_t marker(const std::string& name) const {
    std::size_t m = 0;
    while (set_.markers[m].name != name) ++m;
    return m;
  }
  std::size_t bone(const std::string& name) const {
    std::size_t b = 0;
    while (set_.skeleton.bones[b].name != name) ++b;
    return b;
  }
  const MarkerSet& set() const { return set_; }
  double t_s() const { return sets_ * kStep_s; }
  void show(std::size_t m, bool measured) { shows_[m] = measured; }
  void show_all(bool measured) { std::fill(shows_.begin(), shows_.end(), measured); }
  /// One camera at `eye` observes the marker, at an offset of `off_m` from its true position.
  void observe_by_ray(std::size_t m, const Eigen::Vector3d& eye,
                      const Eigen::Vector3d& off_m = Eigen::Vector3d::Zero()) {
    rays_.push_back({m, eye, off_m});
  }
  void end_ray(std::size_t m) {
    std::erase_if(rays_, [m](const Ray& ray) { return ray.marker == m; });
  }
  void noise(double sigma_m) { noise_m_ = sigma_m; }
  /// Factor on the speed of the motion.
  void pace(double factor) { pace_ = factor; }
  void bend_left_hand(const Eigen::Vector3d& phi) { left_hand_ = phi; }
  /// Gives the solver the body model that it has.
  void refit() {
    SubjectFit fit;
    for (const Bone& one : set_.skeleton.bones) fit.rest_offsets_m.push_back(one.rest_offset_m);
    for (const MarkerOnBone& one : set_.markers) fit.marker_offsets_m.push_back(one.offset_m);
    solver_->refit(fit);
  }
  void corrupt(std::size_t m, const Eigen::Vector3d& position) { corrupted_.emplace_back(m, position); }

  Eigen::Vector3d true_marker(std::size_t m) const {
    const MarkerOnBone& on = set_.markers[m];
    return truth_[static_cast<std::size_t>(on.bone)] * on.offset_m;
  }
  const Pose& true_bone(std::size_t b) const { return truth_[b]; }
  const SubjectPose& pose() const { return *pose_; }
  const BonePose& published(std::size_t b) const { return pose_->bones[b]; }
  const LabelledMarker& label(std::size_t m) const { return labels_[0].markers[m]; }
  SkeletonSolver& solver() { return *solver_; }
  /// The arguments of the last call of the solver.
  const Labels& given() const { return given_; }
  const std::vector<LabelledBearing>& bearings() const { return bearings_; }
  Timestamp at() const { return at_; }
  double error_m(std::size_t b) const { return (published(b).world_from_bone.position - truth_[b].position).norm(); }

  /// Both arms and legs swing, elbows and knees bend, the body moves and rotates.
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) step_once();
  }

 private:
  struct Ray {
    std::size_t marker;
    Eigen::Vector3d eye;
    Eigen::Vector3d off_m;
  };

  void move() {
    const double t = moved_s_;
    moved_s_ += pace_ * kStep_s;
    std::vector<Eigen::Quaterniond> rotations;
    for (const Bone& one : set_.skeleton.bones) {
      Eigen::Vector3d phi = Eigen::Vector3d::Zero();
      if (one.parent < 0) phi = {0.0, 0.05 * std::sin(2.0 * t), 0.3 * std::sin(0.8 * t)};
      if (one.name == "LeftUpArm") phi = {-0.9, 0.0, 0.5 * std::sin(4.0 * t)};
      if (one.name == "RightUpArm") phi = {0.9, 0.0, 0.5 * std::sin(4.0 * t)};
      if (one.name == "LeftLowArm") phi = {0.0, 0.0, -0.7 - 0.5 * std::sin(4.0 * t)};
      if (one.name == "RightLowArm") phi = {0.0, 0.0, 0.7 - 0.4 * std::sin(4.0 * t)};
      if (one.name == "LeftHand") phi = left_hand_;
      if (one.name == "LeftUpLeg") phi = {0.0, 0.4 * std::sin(4.0 * t), 0.0};
      if (one.name == "RightUpLeg") phi = {0.0, -0.4 * std::sin(4.0 * t), 0.0};
      if (one.name == "LeftLowLeg") phi = {0.0, 0.5 + 0.4 * std::sin(4.0 * t), 0.0};
      rotations.push_back(kinematics::from_rotation_vector(phi));
    }
    kinematics::compute_forward_kinematics(set_.skeleton, {0.3 * std::sin(t), 0.2 * t, 1.0}, rotations, truth_);
  }

  void step_once() {
    move();
    labels_[0].markers.clear();
    for (std::size_t m = 0; m < shows_.size(); ++m) {
      LabelledMarker& label = labels_[0].markers.push_back({});
      if (!shows_[m]) continue;
      label.state = LabelState::Measured;
      label.position.v = true_marker(m);
      for (int axis = 0; axis < 3; ++axis) label.position.v[axis] += noise_m_ * normal_(random_);
      label.covariance_m2 = (noise_m_ * noise_m_ + 1e-8) * Eigen::Matrix3d::Identity();
      label.cameras = 4;
    }
    for (const auto& [m, position] : corrupted_) labels_[0].markers[m].position.v = position;
    bearings_.clear();
    for (const auto& [m, eye, off_m] : rays_) {
      const Label label{SubjectId{0}, static_cast<std::uint32_t>(m)};
      bearings_.push_back({label, CameraId{3}, {eye}, (true_marker(m) + off_m - eye).normalized(), 1e-4});
    }
    given_ = labels_;
    at_ = from_ns(1'000'000'000) + from_s(t_s());
    const SolvedSubjects& solved = solver_->solve(labels_, at_, bearings_);
    labels_ = solved.labels;
    pose_ = &solved.poses[0];
    ++sets_;
  }

  MarkerSet set_;
  std::unique_ptr<SkeletonSolver> solver_;
  std::vector<Pose> truth_;
  std::vector<bool> shows_;
  std::vector<Ray> rays_;
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> corrupted_;
  Labels labels_, given_;
  std::vector<LabelledBearing> bearings_;
  Timestamp at_;
  const SubjectPose* pose_ = nullptr;
  double noise_m_ = 0.0;
  double pace_ = 1.0;
  double moved_s_ = 0.0;
  Eigen::Vector3d left_hand_ = Eigen::Vector3d::Zero();
  int sets_ = 0;
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
};

}  // namespace mocap::test
