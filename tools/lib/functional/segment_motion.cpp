#include "lib/functional/segment_motion.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "geometry/rigid_fit.h"

namespace mocap::functional {
namespace {

constexpr int kIterations = 5;
// The markers of a segment with an orientation have a standard deviation of at least this in two directions: noise of
// 2 mm then turns the segment by at most 0.2 rad.
constexpr double kMinSpread_m = 0.010;

// The points of a segment in a take: its markers, and its joint if that is known.
class Points {
 public:
  Points(const bodyfit::LabelledTake& take, const Segment& markers, std::span<const Eigen::Vector3d> joint_places_m)
      : take_(take), markers_(markers), joint_places_m_(joint_places_m) {}

  std::size_t frames() const { return take_.frames(); }
  std::size_t size() const { return markers_.size() + (joint_places_m_.empty() ? 0 : 1); }
  const Eigen::Vector3d& at(std::size_t frame, std::size_t i) const {
    return i < markers_.size() ? take_.frame(frame)[markers_[i]] : joint_places_m_[frame];
  }
  std::size_t seen(std::size_t frame) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < size(); ++i) count += at(frame, i).allFinite() ? 1 : 0;
    return count;
  }

 private:
  const bodyfit::LabelledTake& take_;
  const Segment& markers_;
  std::span<const Eigen::Vector3d> joint_places_m_;
};

// The frame that shows most points; the reference if it shows as many.
std::size_t fullest_frame(const Points& points, std::size_t reference) {
  std::size_t fullest = reference;
  for (std::size_t f = 0; f < points.frames(); ++f) {
    if (points.seen(f) > points.seen(fullest)) fullest = f;
  }
  return fullest;
}

bool spreads_off_a_line(const std::vector<Eigen::Vector3d>& shape_m) {
  std::vector<Eigen::Vector3d> known;
  for (const Eigen::Vector3d& place : shape_m) {
    if (place.allFinite()) known.push_back(place);
  }
  if (known.size() < 3) return false;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : known) mean += place / static_cast<double>(known.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& place : known)
    covariance += (place - mean) * (place - mean).transpose() / static_cast<double>(known.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[1] > kMinSpread_m * kMinSpread_m;
}

std::optional<Pose> pose_in(const Points& points, const std::vector<Eigen::Vector3d>& shape_m, std::size_t frame,
                            std::vector<geometry::PointPair>& pairs) {
  pairs.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& place = points.at(frame, i);
    if (place.allFinite() && shape_m[i].allFinite()) pairs.push_back({shape_m[i], place});
  }
  const auto fit = geometry::fit_rigid(pairs);
  return fit ? std::optional(fit->to_from) : std::nullopt;
}

void average_shape(const Points& points, SegmentMotion& motion) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0.0;
    for (std::size_t f = 0; f < points.frames(); ++f) {
      if (!motion.world_from_segment[f] || !points.at(f, i).allFinite()) continue;
      sum += motion.world_from_segment[f]->inverse() * points.at(f, i);
      count += 1.0;
    }
    if (count > 0.0) motion.shape_m[i] = sum / count;
  }
}

void change_frame(SegmentMotion& motion, const Pose& new_from_old) {
  for (Eigen::Vector3d& place : motion.shape_m) place = new_from_old * place;
  for (auto& pose : motion.world_from_segment) {
    if (pose) *pose = *pose * new_from_old.inverse();
  }
}

}  // namespace

SegmentMotion track_segment(const bodyfit::LabelledTake& take, const Segment& segment, std::size_t reference,
                            std::span<const Eigen::Vector3d> joint_places_m) {
  const Points points(take, segment, joint_places_m);
  SegmentMotion motion{.markers = segment};
  const std::size_t fullest = fullest_frame(points, reference);
  for (std::size_t i = 0; i < points.size(); ++i) motion.shape_m.push_back(points.at(fullest, i));
  if (spreads_off_a_line(motion.shape_m)) {
    motion.world_from_segment.resize(take.frames());
    std::vector<geometry::PointPair> pairs;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      for (std::size_t f = 0; f < take.frames(); ++f)
        motion.world_from_segment[f] = pose_in(points, motion.shape_m, f, pairs);
      average_shape(points, motion);
    }
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& place : motion.shape_m) centre += place / static_cast<double>(motion.shape_m.size());
    const auto& poses = motion.world_from_segment;
    const auto first = std::ranges::find_if(poses, [](const auto& pose) { return pose.has_value(); });
    const auto shown = poses[reference] ? poses.begin() + static_cast<std::ptrdiff_t>(reference) : first;
    const Eigen::Quaterniond rotation = shown == poses.end() ? Eigen::Quaterniond::Identity() : (*shown)->rotation;
    change_frame(motion, {-(rotation * centre), rotation});
  }
  if (!joint_places_m.empty()) {
    motion.joint_m = motion.shape_m.back();
    motion.shape_m.pop_back();
  }
  return motion;
}

}  // namespace mocap::functional
