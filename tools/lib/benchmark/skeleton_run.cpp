#include "lib/benchmark/skeleton_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>
#include <vector>

#include "lib/benchmark/point_pipeline.h"
#include "lib/thread_time.h"
#include "scene/ring_rig.h"

namespace mocap::benchmark {
namespace {

constexpr double kFirst_s = 5.0;
constexpr Timestamp kSkeletonBegin = from_ns(1'000'000'000);

bodyfit::LabelledTake part_of(const bodyfit::LabelledTake& take, std::size_t from, std::size_t to) {
  const auto at = [&](std::size_t frame) {
    return take.places_m.begin() + static_cast<std::ptrdiff_t>(frame * take.markers);
  };
  return {take.markers, {at(from), at(to)}};
}

Result<Subject> posed_subject_of(const PosedClip& posed, SkeletonKnown mode) {
  const LabelledClip& clip = posed.clip;
  if (mode == SkeletonKnown::Live) return Subject{"benchmark", clip.marker_set, false};
  if (mode == SkeletonKnown::Given) return Subject{"benchmark", posed.body, true};
  const auto at_s = [&](double t_s) { return std::min(clip.frames(), static_cast<std::size_t>(t_s * clip.rate_hz)); };
  const std::size_t rest = at_s(kClipTPose_s), end = mode == SkeletonKnown::FirstFive ? at_s(kFirst_s) : clip.frames();
  auto fit = bodyfit::fit_subject(clip.marker_set, part_of(clip.take, 0, rest), part_of(clip.take, rest, end), {});
  if (!fit) return Error{ErrorCode::InvalidArgument, fmt::format("clip '{}': the body cannot be fitted", clip.name)};
  return Subject{"benchmark", std::move(fit->marker_set), true};
}

double degrees_between(const Eigen::Quaterniond& one, const Eigen::Quaterniond& other) {
  return one.angularDistance(other) * 180.0 / std::numbers::pi;
}

// Errors of all joints so far.
class Errors {
 public:
  explicit Errors(const Skeleton& skeleton) : counts_(skeleton.bones.size()) {
    for (const Bone& bone : skeleton.bones) bones_.push_back({bone.name});
  }

  void add(const SubjectPose& pose, const Pose* truth) {
    ++posed_;
    for (std::size_t b = 0; b < pose.bones.size(); ++b) {
      const BonePose& bone = pose.bones[b];
      if (bone.state == BoneState::Lost) continue;
      const double joint_cm = 100.0 * (bone.world_from_bone.position - truth[b].position).norm();
      joints_cm_.push_back(joint_cm);
      bones_[b].joint_cm += joint_cm;
      bones_[b].rotation_deg += degrees_between(bone.world_from_bone.rotation, truth[b].rotation);
      ++counts_[b];
    }
  }

  SkeletonFigures figures(std::uint64_t frames) {
    SkeletonFigures figures;
    figures.frames = frames;
    if (joints_cm_.empty()) return figures;
    const auto joints = static_cast<double>(joints_cm_.size());
    figures.posed_share = static_cast<double>(posed_) / static_cast<double>(frames);
    figures.joint_cm = figures.rotation_deg = 0.0;
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      figures.joint_cm += bones_[b].joint_cm / joints;
      figures.rotation_deg += bones_[b].rotation_deg / joints;
      bones_[b].joint_cm /= std::max(1.0, counts_[b]);
      bones_[b].rotation_deg /= std::max(1.0, counts_[b]);
    }
    figures.bones = bones_;
    const auto high = joints_cm_.begin() + static_cast<std::ptrdiff_t>(joints_cm_.size() * 99 / 100);
    std::ranges::nth_element(joints_cm_, high);
    figures.joint_p99_cm = *high;
    return figures;
  }

 private:
  std::vector<double> joints_cm_;
  std::vector<BoneFigures> bones_;  // sums
  std::vector<double> counts_;
  std::uint64_t posed_ = 0;
};

}  // namespace

std::optional<SkeletonKnown> skeleton_mode_named(std::string_view name) {
  const auto found = std::ranges::find(kSkeletonModes, name);
  if (found == std::end(kSkeletonModes)) return std::nullopt;
  return static_cast<SkeletonKnown>(found - std::begin(kSkeletonModes));
}

Result<SkeletonFigures> run_skeleton(const PosedClip& posed, SkeletonKnown mode, const PointNoise& noise,
                                     std::uint64_t seed) {
  const LabelledClip& clip = posed.clip;
  const auto subject = posed_subject_of(posed, mode);
  if (!subject) return subject.error();
  // The beginning has no noise, so that the person is identified in every mode.
  const std::vector<NoisyFrame> clean = add_noise(clip, {}, seed), noisy = add_noise(clip, noise, seed);

  settings::DaemonSettings settings;
  settings.subject_models.push_back(*subject);
  settings.nominal_rate_hz = clip.rate_hz;
  settings.rig = scene::ring_rig({});  // required, but no camera takes part
  PointPipeline pipeline(settings);
  Errors errors(posed.body.skeleton);
  double spent_s = 0.0;
  for (std::size_t i = 0; i < clip.frames(); ++i) {
    const double begun_s = to_s(thread_time());
    const Snapshot& snapshot = pipeline.step(kSkeletonBegin + from_s(static_cast<double>(i) / clip.rate_hz),
                                             i < posed.begin ? clean[i] : noisy[i]);
    if (i < posed.begin) continue;
    spent_s += to_s(thread_time()) - begun_s;
    if (!snapshot.poses.empty() && !snapshot.poses[0].bones.empty()) errors.add(snapshot.poses[0], posed.bones(i));
  }
  const std::uint64_t frames = clip.frames() - posed.begin;
  SkeletonFigures figures = errors.figures(frames);
  figures.ms_per_frame = 1e3 * spent_s / static_cast<double>(std::max<std::uint64_t>(1, frames));
  return figures;
}

}  // namespace mocap::benchmark
