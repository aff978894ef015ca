#include "identify/uncalibrated_body_finder.h"

#include <algorithm>
#include <array>
#include <limits>

#include "pose/point_cloud.h"

namespace mocap::identify {
namespace {

// In the order of the searches. A body is found by a set that is 5 % too large or too small, not by one of 16 %
// (decision 0008).
constexpr std::array<double, 5> kSizes{1.0, 0.9, 1.1, 0.8, 1.2};
// Uncertainty of a body of unknown dimensions, and of one that was fitted to one instant (decision 0008).
constexpr BodyUncertainty kUncalibrated{.marker_sigma_m = 0.012, .joint_sigma_m = 0.020};
constexpr BodyUncertainty kFittedOnce{.marker_sigma_m = 0.006, .joint_sigma_m = 0.012};
// Work of one step of the fit of the dimensions, in bone fits, by its time: 26 to 46 us with 39 to 61 markers.
constexpr std::size_t kFitWork = 40;

}  // namespace

UncalibratedBodyFinder::UncalibratedBodyFinder(const MarkerSet& set)
    : set_(set),
      finder_(set, {}),
      fitter_(set, bodyfit::OffsetPriors{}, 1),
      instants_(1, bodyfit::empty_instant(set)),
      offsets_(bodyfit::offsets_of(set)) {
  points_.reserve(pose::kMaxCloudPoints);
}

void UncalibratedBodyFinder::begin(std::span<const Eigen::Vector3d> points) {
  found_.reset();
  points = points.first(std::min(points.size(), pose::kMaxCloudPoints));
  points_.assign(points.begin(), points.end());
  size_ = kSizes[next_size_];
  for (std::size_t b = 0; b < offsets_.bones_m.size(); ++b)
    offsets_.bones_m[b] = size_ * set_.skeleton.bones[b].rest_offset_m;
  for (std::size_t m = 0; m < offsets_.markers_m.size(); ++m) offsets_.markers_m[m] = size_ * set_.markers[m].offset_m;
  finder_.refit(offsets_.bones_m, offsets_.markers_m);
  finder_.begin(points_, kUncalibrated);
  stage_ = finder_.searching() ? Stage::Search : Stage::Idle;
  if (finder_.searching()) next_size_ = (next_size_ + 1) % kSizes.size();
}

bool UncalibratedBodyFinder::advance(std::size_t work) {
  while (stage_ != Stage::Idle && work > 0) work -= std::min(work, step(work));
  return stage_ == Stage::Idle;
}

// Continues the search or the fit in progress. Returns the work done.
std::size_t UncalibratedBodyFinder::step(std::size_t work) {
  if (stage_ == Stage::Fit || stage_ == Stage::FinalFit) {
    if (!fitter_.work()) return kFitWork;
    offsets_ = fitter_.offsets();
    size_ = fitter_.size();
    stage_ == Stage::Fit ? confirm() : describe();
    return kFitWork;
  }
  const std::size_t before = finder_.work();
  if (finder_.advance(work)) {
    pose_ = finder_.found();
    if (pose_) {
      fit(stage_ == Stage::Search ? Stage::Fit : Stage::FinalFit);
    } else {
      stage_ = Stage::Idle;
    }
  }
  return std::max<std::size_t>(1, finder_.work() - before);
}

// Begins to fit the dimensions to the points of the pose.
void UncalibratedBodyFinder::fit(Stage stage) {
  bodyfit::BodyInstant& instant = instants_[0];
  for (std::size_t m = 0; m < set_.markers.size(); ++m) {
    const int p = pose_->point_of_marker[m];
    instant.trust[m] = p < 0 ? 0.0 : 1.0;
    instant.seen_m[m] = p < 0 ? Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())
                              : points_[static_cast<std::size_t>(p)];
  }
  std::copy(pose_->locals.begin(), pose_->locals.end(), instant.locals.begin());
  fitter_.begin(offsets_, size_, instants_);
  stage_ = stage;
}

void UncalibratedBodyFinder::confirm() {
  finder_.refit(offsets_.bones_m, offsets_.markers_m);
  finder_.begin(points_, kFittedOnce);
  stage_ = finder_.searching() ? Stage::Confirm : Stage::Idle;
}

void UncalibratedBodyFinder::describe() {
  found_.emplace();
  found_->pose = *pose_;
  for (const Eigen::Vector3d& offset : offsets_.bones_m) found_->rest_offsets_m.push_back(offset);
  for (const Eigen::Vector3d& offset : offsets_.markers_m) found_->marker_offsets_m.push_back(offset);
  found_->rms_m = fitter_.rms_m();
  std::copy(instants_[0].locals.begin(), instants_[0].locals.end(), found_->pose.locals.begin());
  stage_ = Stage::Idle;
}

void UncalibratedBodyFinder::adopt(UncalibratedBodyFinder& before) {
  finder_.adopt(before.finder_);
  fitter_ = std::move(before.fitter_);
  instants_ = std::move(before.instants_);
  offsets_ = std::move(before.offsets_);
  size_ = before.size_;
  next_size_ = before.next_size_;
  points_ = std::move(before.points_);
  stage_ = before.stage_;
  pose_ = before.pose_;
  found_ = std::move(before.found_);
}

void UncalibratedBodyFinder::archive(Archive& members) {
  members(finder_, fitter_, offsets_, size_, next_size_, points_, stage_, pose_, found_);
  if (stage_ == Stage::Fit || stage_ == Stage::FinalFit) fitter_.archive_fit(members, instants_);
  if (!members.is_reading()) return;
  const std::size_t markers = set_.markers.size(), bones = set_.skeleton.bones.size();
  const auto is_complete = [&](const FoundPose& pose) {
    return pose.point_of_marker.size() == markers && pose.locals.size() == bones &&
           std::ranges::all_of(pose.point_of_marker, [&](int p) { return p < static_cast<int>(points_.size()); });
  };
  const bool fits = offsets_.bones_m.size() == bones && offsets_.markers_m.size() == markers &&
                    next_size_ < kSizes.size() && points_.size() <= pose::kMaxCloudPoints;
  const bool searches = stage_ == Stage::Search || stage_ == Stage::Confirm;
  const bool has_pose = stage_ < Stage::Confirm || stage_ == Stage::Idle || (pose_ && is_complete(*pose_));
  if (!fits || !has_pose || stage_ < Stage::Idle || stage_ > Stage::FinalFit || searches != finder_.searching() ||
      (searches && finder_.point_count() != points_.size()) ||
      (found_ && !(is_complete(found_->pose) && found_->rest_offsets_m.size() == bones &&
                   found_->marker_offsets_m.size() == markers)))
    members.fail();
}

}  // namespace mocap::identify
