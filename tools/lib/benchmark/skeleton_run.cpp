#include "lib/benchmark/skeleton_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "lib/benchmark/point_pipeline.h"
#include "lib/benchmark/skeleton_bound.h"
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

}  // namespace

std::optional<SkeletonKnown> skeleton_mode_named(std::string_view name) {
  const auto found = std::ranges::find(kSkeletonModes, name);
  if (found == std::end(kSkeletonModes)) return std::nullopt;
  return static_cast<SkeletonKnown>(found - std::begin(kSkeletonModes));
}

Result<SkeletonFigures> run_skeleton(const PosedClip& posed, SkeletonKnown mode, const PointNoise& noise,
                                     std::uint64_t seed) {
  if (mode == SkeletonKnown::Bound) return skeleton_bound(posed, noise, seed);
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
  SkeletonErrors errors(posed.body.skeleton);
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
