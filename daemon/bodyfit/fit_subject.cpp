#include "bodyfit/fit_subject.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/expects.h"
#include "bodyfit/subject_fitter.h"
#include "geometry/rigid_fit.h"
#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::bodyfit {
namespace {

// In a held pose, a joint nearer to the rest pose than this is in rest pose, if its ancestors are, too.
// Chosen by hand; not yet measured.
constexpr double kMaxRestAngle_rad = 0.45;
// Tilt of the root of a standing subject. The prior prevents a tilt that would explain low front markers of the pelvis.
// Chosen by hand; not yet measured.
constexpr double kUprightSigma_rad = 0.1;
// In a held pose the labels are right, but a marker may be anywhere on its bone: hardly any marker is an outlier.
constexpr OutlierScale kAtRestOutliers{0.4, 0.4};
// Joints from rest pose in the first fit: wide enough for arms that hang down, and prevents a twist about axes that the
// markers hardly observe. Chosen by hand; not yet measured.
constexpr double kInitialRestSigma_rad = 0.25;
// Standard deviation and outlier scale of a marker before the body is fitted: markers are placed by hand.
// Chosen by hand; not yet measured.
constexpr double kInitialMarkerSigma_m = 0.015;
constexpr double kInitialOutlier_m = 0.15;
constexpr double kFrame_s = 0.01;  // frame interval for the tracker; takes have no time stamps here
constexpr double kMinSize = 0.4, kMaxSize = 1.6;
constexpr std::size_t kMaxCandidates = 2000;  // instants among which the most different poses are selected

bool is_measured(const Eigen::Vector3d& place) { return place.allFinite(); }

std::size_t seen_in(std::span<const Eigen::Vector3d> frame) {
  return static_cast<std::size_t>(std::count_if(frame.begin(), frame.end(), is_measured));
}

std::vector<kinematics::Observation> observations(std::span<const Eigen::Vector3d> frame, double sigma_m) {
  std::vector<kinematics::Observation> seen;
  for (std::size_t m = 0; m < frame.size(); ++m) {
    if (is_measured(frame[m])) seen.push_back({static_cast<int>(m), frame[m], sigma_m});
  }
  return seen;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Median position of each marker in a take of a held pose.
std::vector<Eigen::Vector3d> median_positions(const LabelledTake& take) {
  std::vector<Eigen::Vector3d> middle(take.markers,
                                      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t m = 0; m < take.markers; ++m) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t f = 0; f < take.frames(); ++f) {
        if (is_measured(take.frame(f)[m])) values.push_back(take.frame(f)[m][axis]);
      }
      if (!values.empty()) middle[m][axis] = median(values);
    }
  }
  return middle;
}

// Size of a body relative to the file: the median ratio of distances between markers of one bone or of two connected
// bones.
double rough_size(const MarkerSet& file, const LabelledTake& take) {
  kinematics::PoseFit rest(file, kinematics::PoseFit::Lengths::Fixed);
  std::vector<double> ratios;
  const std::size_t step = std::max<std::size_t>(1, take.frames() / 50);
  for (std::size_t f = 0; f < take.frames(); f += step) {
    const auto frame = take.frame(f);
    for (std::size_t a = 0; a < file.markers.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const int bone_a = file.markers[a].bone, bone_b = file.markers[b].bone;
        const bool is_adjacent = bone_a == bone_b ||
                                 file.skeleton.bones[static_cast<std::size_t>(bone_a)].parent == bone_b ||
                                 file.skeleton.bones[static_cast<std::size_t>(bone_b)].parent == bone_a;
        const double apart = (rest.marker_at(a) - rest.marker_at(b)).norm();
        if (is_adjacent && apart > 0.15 && is_measured(frame[a]) && is_measured(frame[b])) {
          ratios.push_back((frame[a] - frame[b]).norm() / apart);
        }
      }
    }
  }
  return ratios.empty() ? 1.0 : std::clamp(median(ratios), kMinSize, kMaxSize);
}

MarkerSet sized(const MarkerSet& file, double size) {
  MarkerSet set = file;
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= size;
  for (MarkerOnBone& marker : set.markers) marker.offset_m *= size;
  return set;
}

// Marks the joints of a held pose that are in rest pose.
void find_rest(const Skeleton& skeleton, BodyInstant& instant) {
  instant.at_rest[0] = 1;
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const bool parent_at_rest = instant.at_rest[static_cast<std::size_t>(skeleton.bones[b].parent)] != 0;
    instant.at_rest[b] =
        parent_at_rest && kinematics::rotation_vector(instant.locals[b].rotation).norm() < kMaxRestAngle_rad ? 1 : 0;
  }
}

// The instant of a held pose; nothing if too few markers are measured.
std::optional<BodyInstant> instant_at_rest(const MarkerSet& rough, const LabelledTake& take,
                                           double min_marker_fraction) {
  const std::vector<Eigen::Vector3d> middle = median_positions(take);
  if (static_cast<double>(seen_in(middle)) < min_marker_fraction * static_cast<double>(middle.size()))
    return std::nullopt;
  kinematics::PoseFit pose(rough, kinematics::PoseFit::Lengths::Fixed);
  std::vector<geometry::PointPair> pairs;
  for (std::size_t m = 0; m < middle.size(); ++m) {
    if (is_measured(middle[m])) pairs.push_back({pose.marker_at(m), middle[m]});
  }
  const auto place = geometry::fit_upright(pairs);
  if (!place) return std::nullopt;
  pose.place({place->translation, Eigen::Quaterniond(Eigen::AngleAxisd(place->yaw_rad, Eigen::Vector3d::UnitZ()))});
  std::vector<double> prior_sigma_rad(rough.skeleton.bones.size(), 1e3);
  if (prior_sigma_rad.size() > 1) prior_sigma_rad[0] = kUprightSigma_rad;
  const kinematics::PosePrior prior{.rest_sigma_rad = kInitialRestSigma_rad,
                                    .prior_sigma_rad = prior_sigma_rad,
                                    .prior_root_sigma_m = 10.0,
                                    .outlier_m = 2.0 * kInitialOutlier_m};
  (void)pose.solve(observations(middle, kInitialMarkerSigma_m), prior, 60);
  BodyInstant instant = empty_instant(rough);
  instant.seen_m = middle;
  instant.locals.assign(pose.locals().begin(), pose.locals().end());
  if (rough.skeleton.bones.size() > 1) find_rest(rough.skeleton, instant);
  return instant;
}

// Tracks a body through a take. Calls `each` with the frame and the pose for each frame with enough markers.
template <class Each>
void track(const MarkerSet& body, const LabelledTake& take, std::size_t step, double min_marker_fraction,
           double outlier_m, const Each& each) {
  pose::SkeletonTracker tracker(body, {.outlier_m = outlier_m, .max_iterations = 12});
  for (std::size_t f = 0; f < take.frames(); f += step) {
    const auto frame = take.frame(f);
    if (static_cast<double>(seen_in(frame)) < min_marker_fraction * static_cast<double>(frame.size())) continue;
    const std::vector<kinematics::Observation> seen = observations(frame, kInitialMarkerSigma_m);
    const Timestamp at = from_ns(0) + from_s(kFrame_s * static_cast<double>(f));
    if (!tracker.is_tracking()) {
      if (!tracker.start(seen, at)) continue;
    } else {
      tracker.predict(at);
      (void)tracker.update(seen);
      tracker.commit(seen);
    }
    each(frame, tracker.pose().locals());
  }
}

// Adds the most different poses of a take: each is the farthest from all added before it (farthest-point sampling).
void add_different(const MarkerSet& rough, const LabelledTake& take, const FitSettings& settings,
                   std::vector<BodyInstant>& into) {
  std::vector<BodyInstant> candidates;
  const std::size_t step = std::max<std::size_t>(1, take.frames() / kMaxCandidates);
  track(rough, take, step, settings.min_marker_fraction, kInitialOutlier_m,
        [&](std::span<const Eigen::Vector3d> frame, std::span<const Pose> locals) {
          BodyInstant instant = empty_instant(rough);
          instant.seen_m.assign(frame.begin(), frame.end());
          instant.locals.assign(locals.begin(), locals.end());
          candidates.push_back(std::move(instant));
        });
  std::vector<double> nearest(candidates.size(), std::numeric_limits<double>::infinity());
  for (const BodyInstant& taken : into) {
    for (std::size_t i = 0; i < candidates.size(); ++i)
      nearest[i] = std::min(nearest[i], pose_distance(candidates[i].locals, taken.locals));
  }
  while (into.size() < settings.max_instants && !candidates.empty()) {
    const auto furthest = static_cast<std::size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
    if (!(nearest[furthest] > 0.0)) break;
    into.push_back(candidates[furthest]);
    for (std::size_t i = 0; i < candidates.size(); ++i)
      nearest[i] = std::min(nearest[i], pose_distance(candidates[i].locals, into.back().locals));
  }
}

class ResidualSum {
 public:
  explicit ResidualSum(const MarkerSet& set) : set_(set), squares_(set.markers.size()), counts_(set.markers.size()) {}

  void add(std::size_t marker, double off_m) {
    squares_[marker] += off_m * off_m;
    ++counts_[marker];
  }

  FitResiduals make_residuals() const {
    FitResiduals residuals;
    std::vector<double> of_bone(set_.skeleton.bones.size());
    std::vector<int> on_bone(of_bone.size());
    double sum = 0.0;
    int count = 0;
    for (std::size_t m = 0; m < squares_.size(); ++m) {
      residuals.marker_rms_m.push_back(rms(squares_[m], counts_[m]));
      residuals.marker_count.push_back(counts_[m]);
      of_bone[static_cast<std::size_t>(set_.markers[m].bone)] += squares_[m];
      on_bone[static_cast<std::size_t>(set_.markers[m].bone)] += counts_[m];
      sum += squares_[m];
      count += counts_[m];
    }
    for (std::size_t b = 0; b < of_bone.size(); ++b) residuals.bone_rms_m.push_back(rms(of_bone[b], on_bone[b]));
    residuals.rms_m = rms(sum, count);
    return residuals;
  }

 private:
  static double rms(double squares, int count) { return count == 0 ? 0.0 : std::sqrt(squares / count); }

  const MarkerSet& set_;
  std::vector<double> squares_;
  std::vector<int> counts_;
};

}  // namespace

Result<FittedSubject, FitFailure> fit_subject(const MarkerSet& file, const LabelledTake& at_rest,
                                              const LabelledTake& moving, const FitSettings& settings) {
  MOCAP_EXPECTS(at_rest.frames() == 0 || at_rest.markers == file.markers.size());
  MOCAP_EXPECTS(moving.frames() == 0 || moving.markers == file.markers.size());
  double size = rough_size(file, at_rest.frames() > 0 ? at_rest : moving);
  MarkerSet rough = sized(file, size);
  SubjectFitter rest_fitter(file, settings.priors, 1, kAtRestOutliers);
  SubjectFitter moving_fitter(file, settings.priors, settings.max_instants + 1);
  std::vector<BodyInstant> instants;
  FittedSubject fitted;
  if (at_rest.frames() > 0) {
    if (auto instant = instant_at_rest(rough, at_rest, settings.min_marker_fraction))
      instants.push_back(*std::move(instant));
  }
  if (!instants.empty()) {
    fitted.from_rest =
        std::any_of(instants[0].at_rest.begin() + 1, instants[0].at_rest.end(), [](auto b) { return b != 0; });
    rest_fitter.begin(offsets_of(rough), size, instants);
    while (!rest_fitter.work()) continue;
    apply_offsets(rest_fitter.offsets(), rough);
    size = rest_fitter.size();
  }
  if (moving.frames() > 0) add_different(rough, moving, settings, instants);
  if (instants.empty()) return FitFailure::NothingSeen;
  SubjectFitter& fitter = moving.frames() > 0 ? moving_fitter : rest_fitter;
  if (moving.frames() > 0) {
    fitter.begin(offsets_of(rough), size, instants);
    while (!fitter.work()) continue;
  }

  fitted.marker_set = file;
  apply_offsets(fitter.offsets(), fitted.marker_set);
  fitted.size = fitter.size();
  fitted.instants = static_cast<int>(instants.size());
  fitted.iterations = fitter.iterations();
  ResidualSum sum(fitted.marker_set);
  for (BodyInstant& instant : instants) {
    (void)fitter.equations().optimise_pose(instant, fitter.offsets(), fitter.cost(), 3);
    for (std::size_t m = 0; m < instant.seen_m.size(); ++m) {
      if (is_measured(instant.seen_m[m])) sum.add(m, (instant.seen_m[m] - fitter.equations().place(m)).norm());
    }
  }
  fitted.residuals = sum.make_residuals();
  return fitted;
}

FitResiduals residuals_of(const MarkerSet& body, const LabelledTake& take, std::size_t step) {
  ResidualSum sum(body);
  kinematics::PoseFit pose(body, kinematics::PoseFit::Lengths::Fixed);
  track(body, take, std::max<std::size_t>(1, step), 0.3, 0.05,
        [&](std::span<const Eigen::Vector3d> frame, std::span<const Pose> locals) {
          pose.set_locals(locals);
          for (std::size_t m = 0; m < frame.size(); ++m) {
            if (is_measured(frame[m])) sum.add(m, (frame[m] - pose.marker_at(m)).norm());
          }
        });
  return sum.make_residuals();
}

}  // namespace mocap::bodyfit
