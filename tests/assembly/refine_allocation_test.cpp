#include <gtest/gtest.h>
#include <pthread.h>

#include <cmath>
#include <memory>
#include <thread>
#include <vector>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "settings/subject/marker_set_file.h"
#include "solve/subject_refiner.h"
#include "support/allocation_counter.h"
#include "support/places.h"

namespace mocap::assembly {
namespace refine_allocation_test {

/// A body that swings each joint at a different frequency; its markers are 10 mm off their nominal positions.
class Swinging {
 public:
  explicit Swinging(const MarkerSet& set) : body_(moved(set), kinematics::PoseFit::Lengths::Fixed) {
    locals_.assign(body_.locals().begin(), body_.locals().end());
    labels_.push_back({SubjectId{0}, SubjectPhase::Tracking, {}});
    poses_.push_back({SubjectId{0}, {}, 0.0});
    labels_[0].markers.resize(set.markers.size());
    poses_[0].bones.resize(set.skeleton.bones.size());
  }

  void at(int set) {
    for (std::size_t b = 0; b < locals_.size(); ++b) {
      const double swing = 0.5 * std::sin(0.002 * set * static_cast<double>(b + 3)) * std::min(1.0, set / 100.0);
      locals_[b].rotation = kinematics::from_rotation_vector({0.4 * swing, swing, 0.3 * swing});
    }
    body_.set_locals(locals_);
    for (std::size_t m = 0; m < labels_[0].markers.size(); ++m) {
      LabelledMarker& label = labels_[0].markers[m];
      label.state = (set / 50 + static_cast<int>(m)) % 17 == 0 ? LabelState::Filled : LabelState::Measured;
      label.position.v = body_.marker_at(m);
      label.covariance_m2 = 1e-7 * Eigen::Matrix3d::Identity();
    }
    for (std::size_t b = 0; b < locals_.size(); ++b) {
      poses_[0].bones[b].world_from_bone = body_.world()[b];
      poses_[0].bones[b].parent_from_bone = body_.locals()[b];
    }
  }

  const Labels& labels() const { return labels_; }
  const Poses& poses() const { return poses_; }

 private:
  static MarkerSet moved(MarkerSet set) {
    for (MarkerOnBone& marker : set.markers) marker.offset_m.z() += 0.01;
    return set;
  }

  kinematics::PoseFit body_;
  std::vector<Pose> locals_;
  Labels labels_;
  Poses poses_;
};

TEST(RefineSubject, DoesNotAllocateAfterConstruction) {
  if (!support::allocations_can_be_counted()) GTEST_SKIP() << "the sanitizer owns the heap";
  const auto set = settings::load_marker_set(support::source_folder() + "/config/markersets/baseline41.toml");
  ASSERT_TRUE(set) << set.error().message;
  solve::SubjectRefiner refiner({.pieces = 10}, {{"somebody", *set}});
  const auto body = std::make_unique<Swinging>(*set);
  SubjectFit fit;
  fit.subject = SubjectId{0};
  fit.at_identification = true;
  for (const Bone& bone : set->skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : set->markers) fit.marker_offsets_m.push_back(marker.offset_m);
  int fits = 0;
  support::AllocationCount count;

  std::thread thread([&] {
    ::pthread_setname_np(::pthread_self(), "mocap-fusion");
    support::start_counting_allocations();
    refiner.recognised(fit);
    for (int i = 0; i < 1500; ++i) {
      body->at(i);
      fits += refiner.step(body->labels(), body->poses(), from_ns(1) + from_s(i / 120.0)) ? 1 : 0;
    }
    count = support::stop_counting_allocations();
  });
  thread.join();

  EXPECT_GE(fits, 2);  // one in the rest pose, one in motion
  EXPECT_EQ(count.by_new, 0U);
  EXPECT_EQ(count.by_malloc, 0U);
}

}  // namespace refine_allocation_test
}  // namespace mocap::assembly
