#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "label/body_labeller.h"
#include "support/test_body.h"

namespace mocap::test {

/// Local rotation of a bone, by its name, `t_s` seconds after the T-pose.
using Motion = std::function<Eigen::Quaterniond(const std::string& bone, double t_s)>;

/// Simulated people and a labeller. Each marker has one 3D track, which a test hides, replaces, shifts or exchanges.
/// The labels are compared with the truth: a label is correct if its track is within 20 mm of the marker. Truth by
/// forward kinematics; 120 sets a second; position noise 0.5 mm; fixed seed.
class LabelWorld {
 public:
  static constexpr double kStep_s = 1.0 / 120.0;
  static constexpr int kTPoseSets = 90;  ///< sets in T-pose before the motion starts

  struct Track {
    TrackId id;
    bool hidden = false;
    bool coasts = false;  ///< not detected, but its track continues
    std::uint32_t missed_sets = 0;
    Eigen::Vector3d off = Eigen::Vector3d::Zero();  ///< of the track from the marker, m
  };
  struct Person {
    MarkerSet set;
    std::unique_ptr<kinematics::PoseFit> truth;
    std::vector<Track> tracks;
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    double heading_rad = 0.0;
    double scale = 1.0;
    Motion motion;
    std::size_t subject = 0;
  };

  LabelWorld() { people_.reserve(kMaxSubjects); }

  /// Adds a person with a shipped marker set, scaled by `scale`.
  Person& add(const std::string& set, Motion motion, const Eigen::Vector3d& place_m = {0.0, 0.0, 1.0},
              double heading_rad = 0.0, double scale = 1.0) {
    Person& one = people_.emplace_back();
    one.set = person(set);
    for (Bone& bone : one.set.skeleton.bones) bone.rest_offset_m *= scale;
    for (MarkerOnBone& marker : one.set.markers) marker.offset_m *= scale;
    one.truth = std::make_unique<kinematics::PoseFit>(one.set, kinematics::PoseFit::Lengths::Fixed);
    one.place_m = place_m;
    one.heading_rad = heading_rad;
    one.scale = scale;
    one.motion = std::move(motion);
    for (std::size_t m = 0; m < one.set.markers.size(); ++m) reappear(one.tracks.emplace_back());
    subjects_.push_back({"actor" + std::to_string(subjects_.size()), person(set)});
    return one;
  }

  const std::vector<Subject>& subjects() const { return subjects_; }
  const Labels& labels() const { return labelling_->labels; }
  std::span<const AmbiguousObservation> ambiguous_observations() const { return labelling_->ambiguous_observations; }
  std::optional<SubjectFit> take_fit() { return std::exchange(fit_, std::nullopt); }
  Timestamp at() const { return from_ns(1'000'000'000) + from_s((sets_ - 1) * kStep_s); }

  Person& actor(std::size_t p = 0) { return people_[p]; }
  std::size_t marker(const std::string& name, std::size_t p = 0) const {
    std::size_t m = 0;
    while (people_[p].set.markers[m].name != name) ++m;
    return m;
  }
  Eigen::Vector3d true_position(std::size_t m, std::size_t p = 0) const { return people_[p].truth->marker_at(m); }
  const LabelledMarker& label(std::size_t m, std::size_t p = 0) const {
    return labels()[people_[p].subject].markers[m];
  }
  SubjectPhase phase(std::size_t p = 0) const { return labels()[people_[p].subject].phase; }
  double error_m(std::size_t m, std::size_t p = 0) const {
    return (label(m, p).position.v - true_position(m, p)).norm();
  }
  bool is_correct(std::size_t m, std::size_t p = 0) const {
    return label(m, p).state == LabelState::Measured && error_m(m, p) < 0.02;
  }
  bool is_wrong(std::size_t m, std::size_t p = 0) const {
    return label(m, p).state == LabelState::Measured && error_m(m, p) >= 0.02;
  }
  int wrong_count() const { return count(&LabelWorld::is_wrong); }
  int correct_count() const { return count(&LabelWorld::is_correct); }
  int marker_count() const {
    std::size_t sum = 0;
    for (const Person& one : people_) sum += one.tracks.size();
    return static_cast<int>(sum);
  }

  label::LabelSettings settings;  ///< used by `identify_all`

  Labeller& labeller() { return *labeller_; }
  /// Gets each set and its labels.
  std::function<void(const TrackedMarkers&, const Predictions&, const Labelling&)> observer;

  /// Positions of tracks that are no marker. They come first in the list of tracks.
  std::vector<Eigen::Vector3d> clutter;

  void exchange(Track& a, Track& b) { std::swap(a.id, b.id); }
  /// The marker is detected again, with a new track.
  void reappear(Track& track) {
    track = {};
    track.id = TrackId{next_id_++};
  }

  void step(int sets = 1) {
    for (int i = 0; i < sets; ++i) step_once();
  }
  /// Continues with a labeller of other subjects, which adopts the belief of the one before. The caller sets
  /// Person::subject.
  void change_subjects(std::vector<Subject> subjects, const Handover& handover) {
    subjects_ = std::move(subjects);
    std::unique_ptr<Labeller> next = label::make_labeller(settings, subjects_);
    next->adopt(*labeller_, handover);
    labeller_ = std::move(next);
  }

  /// Runs the T-pose until all are labelled. A person's subject is then the one with most of the person's tracks.
  void identify_all() {
    labeller_ = label::make_labeller(settings, subjects_);
    step(kTPoseSets);
    for (std::size_t p = 0; p < people_.size(); ++p) {
      for (std::size_t s = 0; s < people_.size(); ++s) {
        people_[p].subject = s;
        int correct_count = 0;
        for (std::size_t m = 0; m < people_[p].tracks.size(); ++m) correct_count += is_correct(m, p) ? 1 : 0;
        if (2 * correct_count > static_cast<int>(people_[p].tracks.size())) break;
      }
    }
  }

 private:
  int count(bool (LabelWorld::*what)(std::size_t, std::size_t) const) const {
    int sum = 0;
    for (std::size_t p = 0; p < people_.size(); ++p) {
      for (std::size_t m = 0; m < people_[p].tracks.size(); ++m) sum += (this->*what)(m, p) ? 1 : 0;
    }
    return sum;
  }

  void pose(Person& one, double t_s) {
    std::vector<Pose> locals;
    for (const Bone& bone : one.set.skeleton.bones) {
      Pose pose{bone.rest_offset_m, one.motion(bone.name, t_s)};
      if (bone.parent < 0) {
        pose.position = one.place_m;
        pose.rotation = kinematics::from_rotation_vector({0.0, 0.0, one.heading_rad}) * pose.rotation;
      }
      locals.push_back(pose);
    }
    one.truth->set_locals(locals);
  }

  void step_once() {
    const double t_s = std::max(0, sets_ - kTPoseSets) * kStep_s;
    TrackedMarkers tracked;
    for (std::size_t i = 0; i < clutter.size(); ++i) {
      TrackedMarker track;
      track.id = TrackId{static_cast<std::uint32_t>(100'000 + i)};
      track.state = TrackState::Confirmed;
      track.position.v = clutter[i];
      track.covariance_m2 = 1e-6 * Eigen::Matrix3d::Identity();
      track.cameras = 4;
      track.age_sets = 10;
      tracked.push_back(track);
    }
    for (Person& one : people_) {
      pose(one, t_s);
      for (std::size_t m = 0; m < one.tracks.size(); ++m) {
        if (one.tracks[m].hidden) continue;
        TrackedMarker track;
        track.id = one.tracks[m].id;
        track.state = TrackState::Confirmed;
        track.position.v = one.truth->marker_at(m) + one.tracks[m].off;
        for (int axis = 0; axis < 3; ++axis) track.position.v[axis] += noise_(random_);
        track.covariance_m2 = 1e-6 * Eigen::Matrix3d::Identity();
        track.cameras = 4;
        one.tracks[m].missed_sets = one.tracks[m].coasts ? one.tracks[m].missed_sets + 1 : 0;
        track.missed_sets = one.tracks[m].missed_sets;
        if (one.tracks[m].coasts) {
          track.state = TrackState::Coasting;
          track.cameras = 0;
        }
        track.age_sets = 10;
        tracked.push_back(track);
      }
    }
    Predictions expected;
    expected.at = from_ns(1'000'000'000) + from_s(sets_++ * kStep_s);
    labelling_ = &labeller_->label(tracked, expected);
    if (labelling_->fit) fit_ = labelling_->fit;
    if (observer) observer(tracked, expected, *labelling_);
  }

  std::vector<Person> people_;
  std::vector<Subject> subjects_;
  std::unique_ptr<Labeller> labeller_;
  const Labelling* labelling_ = nullptr;
  std::optional<SubjectFit> fit_;
  std::uint32_t next_id_ = 100;
  int sets_ = 0;
  std::mt19937 random_{7};
  std::normal_distribution<double> noise_{0.0, 0.0005};
};

/// Motion into a posture within a second, with a small sway.
inline Motion into_posture(std::vector<std::pair<std::string, Eigen::Vector3d>> rotations) {
  return [rotations = std::move(rotations)](const std::string& bone, double t_s) {
    const double share = std::min(1.0, t_s);
    const double sway = 0.03 * std::sin(5.0 * t_s);
    for (const auto& [name, rotation] : rotations) {
      if (name == bone) return kinematics::from_rotation_vector(share * (1.0 + sway) * rotation);
    }
    return Eigen::Quaterniond::Identity();
  };
}

/// Motion of some joints from 1.0 s to 1.5 s after the T-pose, while a test hides the limb.
inline Motion moving_later(std::vector<std::pair<std::string, Eigen::Vector3d>> rotations) {
  return [rotations = std::move(rotations)](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    const double share = std::clamp((t_s - 1.0) / 0.5, 0.0, 1.0);
    for (const auto& [name, rotation] : rotations) {
      if (name == bone) return kinematics::from_rotation_vector(share * rotation);
    }
    return Eigen::Quaterniond::Identity();
  };
}

/// The markers of the bones whose names are in the string `bones`.
inline std::vector<std::size_t> markers_of(const LabelWorld::Person& one, std::string_view bones) {
  std::vector<std::size_t> markers;
  for (std::size_t m = 0; m < one.set.markers.size(); ++m) {
    const auto bone = static_cast<std::size_t>(one.set.markers[m].bone);
    if (bones.find(one.set.skeleton.bones[bone].name) != std::string_view::npos) markers.push_back(m);
  }
  return markers;
}

/// Arms and legs swing as in walking on the spot.
inline Motion walking() {
  return [](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    const double down = 1.1 * std::min(1.0, t_s);
    const double swing = 0.4 * std::sin(6.0 * t_s) * std::min(1.0, t_s);
    if (bone == "LeftUpArm") return kinematics::from_rotation_vector(Eigen::Vector3d(-down, 0.0, swing));
    if (bone == "RightUpArm") return kinematics::from_rotation_vector(Eigen::Vector3d(down, 0.0, swing));
    if (bone == "LeftUpLeg") return kinematics::from_rotation_vector(Eigen::Vector3d(0.0, swing, 0.0));
    if (bone == "RightUpLeg") return kinematics::from_rotation_vector(Eigen::Vector3d(0.0, -swing, 0.0));
    return Eigen::Quaterniond::Identity();
  };
}

/// Both hands together in front of the chest, both feet side by side.
inline Motion hands_and_feet_together() {
  return into_posture({{"LeftUpArm", {0.0, 0.0, -1.85}},
                       {"RightUpArm", {0.0, 0.0, 1.85}},
                       {"LeftUpLeg", {-0.05, 0.0, 0.0}},
                       {"RightUpLeg", {0.05, 0.0, 0.0}}});
}

}  // namespace mocap::test
