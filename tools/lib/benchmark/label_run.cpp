#include "lib/benchmark/label_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "lib/benchmark/point_pipeline.h"
#include "lib/offline/mirror.h"
#include "lib/offline/two_passes.h"
#include "lib/simworld/scene_actors.h"
#include "lib/thread_time.h"
#include "scene/random.h"
#include "scene/ring_rig.h"

namespace mocap::benchmark {
namespace {

constexpr double kTPose_s = 1.0;
constexpr double kAway_s = 0.5;
constexpr Timestamp kBegin = from_ns(1'000'000'000);

// The size of the marker set relative to the person, and the error of its marker offsets (standard deviation, each
// axis) in the modes in which the daemon learns the body: those of the benchmark of skeletons.
constexpr double kSetSize = 1.0 / 0.95;
constexpr double kSetMarkerError_mm = 6.0;

Result<MarkerSet> true_body_of(const LabelledClip& clip, const LabelCase& wanted) {
  const bool from_static = wanted.mode == BodyKnown::Static;
  auto body = fit_body(clip, from_static ? *wanted.static_trial : clip.take, from_static);
  if (body) return *std::move(body);
  return Error{ErrorCode::InvalidArgument,
               fmt::format("take '{}': the body cannot be fitted, no frame has 60 % of the {} markers", clip.name,
                           clip.marker_set.markers.size())};
}

// The daemon's knowledge of the body.
Subject label_subject_of(const MarkerSet& body, const LabelCase& wanted) {
  const bool is_known = wanted.mode == BodyKnown::Given || wanted.mode == BodyKnown::Static;
  if (is_known) return {"benchmark", body, true};
  return {"benchmark", simworld::true_body(body, kSetSize, kSetMarkerError_mm, scene::Random(wanted.seed)), false};
}

// The T-pose before the clip, and the time in which nobody is visible; empty in the other modes.
std::vector<NoisyFrame> prelude_of(const MarkerSet& body, double rate_hz, BodyKnown mode) {
  std::vector<NoisyFrame> frames;
  if (mode != BodyKnown::Calibrated) return frames;
  NoisyFrame pose;
  for (const Eigen::Vector3d& at_m : rest_positions_m(body)) pose.points.push_back({at_m, NoisyPoint::kNobodys});
  frames.assign(static_cast<std::size_t>(kTPose_s * rate_hz), pose);
  frames.resize(frames.size() + static_cast<std::size_t>(kAway_s * rate_hz));
  return frames;
}

// The label that each point of the frame has.
std::vector<int> labels_of(const NoisyFrame& frame, const Snapshot& snapshot) {
  std::vector<int> labels(frame.points.size(), LabelTally::kNull);
  if (snapshot.labels.empty()) return labels;
  for (std::size_t m = 0; m < snapshot.labels[0].markers.size(); ++m) {
    const LabelledMarker& label = snapshot.labels[0].markers[m];
    if (label.state != LabelState::Measured) continue;
    const auto apart_m = [&](const NoisyPoint& point) { return (point.position_m - label.position.v).norm(); };
    const auto nearest = std::ranges::min_element(frame.points, {}, apart_m);
    if (nearest == frame.points.end() || apart_m(*nearest) > kAtThePoint_m) continue;
    labels[static_cast<std::size_t>(nearest - frame.points.begin())] = static_cast<int>(m);
  }
  return labels;
}

std::vector<int> truth_of(const NoisyFrame& frame) {
  std::vector<int> truth;
  for (const NoisyPoint& point : frame.points)
    truth.push_back(point.is_duplicate ? LabelTally::kUnknown : point.marker);
  return truth;
}

void count_withheld(const NoisyFrame& frame, const std::vector<int>& given, const PointPipeline& pipeline,
                    LabelRun& into) {
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const NoisyPoint& point = frame.points[i];
    if (point.marker == NoisyPoint::kNobodys || point.is_duplicate || given[i] != LabelTally::kNull) continue;
    const auto marker = static_cast<std::size_t>(point.marker);
    const Withheld why = why_withheld(pipeline, static_cast<std::uint32_t>(marker), point.position_m);
    ++into.withheld[static_cast<std::size_t>(why)];
    ++into.withheld_of[marker][static_cast<std::size_t>(why)];
  }
}

// Both passes over one clip.
struct LabelRunner {
  const LabelledClip& clip;
  std::vector<NoisyFrame> prelude, frames;
  offline::TwoPasses& passes;
  LabelRun run = {};

  Timestamp at(std::size_t frame) const { return kBegin + from_s(static_cast<double>(frame) / clip.rate_hz); }

  Status run_forwards() {
    PointPipeline pipeline(passes.settings());
    LabelTally tally(clip.take.markers, clip.rate_hz), since_first(clip.take.markers, clip.rate_hz);
    run.withheld_of.resize(clip.take.markers);
    double spent_s = 0.0;
    for (std::size_t i = 0; i < prelude.size() + frames.size(); ++i) {
      const bool is_prelude = i < prelude.size();
      const NoisyFrame& frame = is_prelude ? prelude[i] : frames[i - prelude.size()];
      const double begun_s = to_s(thread_time());
      const Snapshot& snapshot = pipeline.step(at(i), frame);
      const double took_s = to_s(thread_time()) - begun_s;
      if (const Status kept = passes.add(snapshot, pipeline.fit()); !kept) return kept;
      if (is_prelude) continue;
      spent_s += took_s;
      const std::vector<int> truth = truth_of(frame), given = labels_of(frame, snapshot);
      tally.add(truth, given);
      if (tally.has_label()) since_first.add(truth, given);
      count_withheld(frame, given, pipeline, run);
    }
    run.figures = tally.figures();
    run.since_first = since_first.figures();
    run.confusions = tally.confusions();
    run.ms_per_frame = 1e3 * spent_s / static_cast<double>(std::max<std::size_t>(1, frames.size()));
    return {};
  }

  Status run_backwards() {
    passes.turn();
    PointPipeline pipeline(passes.settings());
    const std::size_t last = prelude.size() + frames.size() - 1;
    const offline::Mirror mirror(kBegin, at(last));
    std::vector<std::vector<int>> given(frames.size());
    std::size_t i = frames.size();
    for (const NoisyFrame& frame : reversed(frames)) {
      const Timestamp now = mirror.mirrored(at(prelude.size() + --i));
      const Result<Snapshot> joined = passes.join(pipeline.step(now, frame));
      if (!joined) return joined.error();
      given[i] = labels_of(frame, *joined);
    }
    LabelTally tally(clip.take.markers, clip.rate_hz);
    for (; i < frames.size(); ++i) tally.add(truth_of(frames[i]), given[i]);
    run.offline = tally.figures();
    return {};
  }
};

}  // namespace

std::optional<BodyKnown> mode_named(std::string_view name) {
  const auto found = std::ranges::find(kModeNames, name);
  if (found == std::end(kModeNames)) return std::nullopt;
  return static_cast<BodyKnown>(found - std::begin(kModeNames));
}

std::string_view text_of(BodyKnown mode) { return kModeNames[static_cast<std::size_t>(mode)]; }

Result<LabelRun> run_labels(const LabelledClip& clip, const LabelCase& wanted) {
  const auto body = true_body_of(clip, wanted);
  if (!body) return body.error();
  settings::DaemonSettings settings;
  settings.subject_models.push_back(label_subject_of(*body, wanted));
  settings.nominal_rate_hz = clip.rate_hz;
  settings.label.search_uncalibrated = wanted.mode == BodyKnown::Cold;
  settings.rig = scene::ring_rig({});  // required, but no camera takes part
  auto passes = offline::TwoPasses::create(settings, std::filesystem::temp_directory_path());
  if (!passes) return passes.error();
  LabelRunner runner{clip, prelude_of(*body, clip.rate_hz, wanted.mode), add_noise(clip, wanted.noise, wanted.seed),
                     *passes};
  if (const Status done = runner.run_forwards(); !done) return done.error();
  if (const Status done = runner.run_backwards(); !done) return done.error();
  return std::move(runner.run);
}

}  // namespace mocap::benchmark
