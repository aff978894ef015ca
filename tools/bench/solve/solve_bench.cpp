#include "bench/solve/solve_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "assemble.h"
#include "bench/solve/solve_reference.h"
#include "lib/scoring/labels_score.h"
#include "lib/simworld/recognition.h"
#include "lib/simworld/scene_world.h"
#include "lib/thread_time.h"

namespace mocap::bench {
namespace {

constexpr double kWarmUp_s = 5.0;   // T-pose, identification, and one second of walking
constexpr int kReferenceSets = 60;  // few sets suffice: the reference is slow and varies little
constexpr int kReferenceStep = 4;   // during the warm-up the reference follows the motion with every n-th set

// Centres of the figures of eight (1.1 m) in which up to six people walk, m.
constexpr std::array<std::array<double, 2>, 6> kPlaces_m{
    {{0.0, 0.0}, {0.0, 2.4}, {0.0, -2.4}, {2.4, 1.2}, {2.4, -1.2}, {-2.4, 0.0}}};

double at_share(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

// Adds the CPU time of the thread between constructor and destructor to a sum.
class Stopwatch {
 public:
  explicit Stopwatch(double& spent_us) : spent_us_(spent_us), begun_us_(to_us(thread_time())) {}
  ~Stopwatch() { spent_us_ += to_us(thread_time()) - begun_us_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& spent_us_;
  double begun_us_;
};

class TimedLabeller final : public Labeller {
 public:
  TimedLabeller(std::unique_ptr<Labeller> labeller, double& spent_us)
      : labeller_(std::move(labeller)), spent_us_(spent_us) {}

  const Labelling& label(const TrackedMarkers& tracked, const Predictions& predicted) override {
    const Stopwatch watch(spent_us_);
    return labeller_->label(tracked, predicted);
  }
  void refit(const SubjectFit& fit) override { labeller_->refit(fit); }

 private:
  std::unique_ptr<Labeller> labeller_;
  double& spent_us_;
};

class TimedSolver final : public SkeletonSolver {
 public:
  TimedSolver(std::unique_ptr<SkeletonSolver> solver, double& spent_us)
      : solver_(std::move(solver)), spent_us_(spent_us) {}

  const SolvedSubjects& solve(const Labels& labels, Timestamp at, std::span<const LabelledBearing> rays,
                              std::span<const AmbiguousObservation> ambiguous_observations) override {
    const Stopwatch watch(spent_us_);
    return solver_->solve(labels, at, rays, ambiguous_observations);
  }
  void refit(const SubjectFit& fit) override { solver_->refit(fit); }
  const PredictedMarkers& predict(Timestamp at) override {
    const Stopwatch watch(spent_us_);
    return solver_->predict(at);
  }

 private:
  std::unique_ptr<SkeletonSolver> solver_;
  double& spent_us_;
};

simworld::SceneFile scene_of(const SolveBenchSettings& settings) {
  simworld::SceneFile scene;
  scene.rate_hz = settings.rate_hz;
  scene.ring = {.cameras = 8,
                .radius_m = settings.subjects > 1 ? 7.0 : 4.0,
                .height_m = settings.subjects > 1 ? 3.5 : 2.5,
                .width_px = 1280,
                .height_px = 1024};
  for (int i = 0; i < settings.subjects; ++i) {
    simworld::SceneActor& actor = scene.actors.emplace_back();
    actor.name = "subject" + std::to_string(i + 1);
    actor.motion = "tpose:3,walk";
    actor.marker_set = settings.marker_set;
    actor.place_m = kPlaces_m[static_cast<std::size_t>(i) % kPlaces_m.size()];
    actor.delay_s = 0.21 * i;
    actor.size = 1.0 - 0.03 * i;
  }
  return scene;
}

struct Spans {
  std::vector<double> both_us, label_us, solve_us, reference_us;
  double reference_rms_m = 0.0;  // largest rms of all poses
};

// Measures the reference on the same bodies, from the true positions of all markers.
void time_reference(std::vector<SolveReference>& references, const std::vector<simworld::Performer>& performers,
                    double t_s, Spans& spans) {
  double spent_us = 0.0, worst_rms_m = 0.0;
  scene::ActorState state;
  std::vector<WorldPoint> markers;
  for (std::size_t i = 0; i < references.size(); ++i) {
    performers[i].actor->at(t_s, state);
    markers.clear();
    for (const scene::ActorMarker& marker : state.markers) markers.push_back(marker.position);
    const Stopwatch watch(spent_us);
    worst_rms_m = std::max(worst_rms_m, references[i].solve(markers));
  }
  spans.reference_us.push_back(spent_us);
  spans.reference_rms_m = std::max(spans.reference_rms_m, worst_rms_m);
}

SolveBenchFigures figures_of(const Spans& spans, const scoring::LabelCounts& names,
                             const SolveBenchSettings& settings) {
  SolveBenchFigures f;
  f.subjects = settings.subjects;
  f.median_us = at_share(spans.both_us, 0.5);
  f.p99_us = at_share(spans.both_us, 0.99);
  f.max_us = at_share(spans.both_us, 1.0);
  f.p99_over_median = f.p99_us / f.median_us;
  f.label_us = at_share(spans.label_us, 0.5);
  f.solve_us = at_share(spans.solve_us, 0.5);
  f.ceres_us = at_share(spans.reference_us, 0.5);
  f.ceres_rms_mm = 1000.0 * spans.reference_rms_m;
  f.speedup_ceres = f.ceres_us / f.solve_us;
  f.right_share = names.recall().value_or(0.0);
  f.tracked_share = names.availability().value_or(0.0);
  return f;
}

}  // namespace

Result<SolveBenchFigures> run_solve_bench(const SolveBenchSettings& settings) {
  const simworld::SceneFile scene = scene_of(settings);
  auto performers = simworld::make_performers(scene, "", settings.seed);
  if (!performers) return performers.error();
  settings::DaemonSettings daemon;
  daemon.rig = scene::ring_rig(scene.ring);
  std::vector<SolveReference> references;
  int markers = 0;
  for (const simworld::Performer& performer : *performers) {
    daemon.subject_models.push_back(performer.subject);
    references.emplace_back(performer.actor->marker_set());
    markers += static_cast<int>(performer.subject.marker_set.markers.size());
  }
  auto events = simworld::SceneEvents::make(scene, *performers, daemon.rig.size(), settings.seed, true);
  if (!events) return events.error();
  simworld::SceneWorld world(scene, daemon.rig, std::move(*performers), std::move(*events), settings.seed);

  simworld::Recognition recognition(world.performers());
  double label_us = 0.0, solve_us = 0.0;
  fusion::FusionParts parts = assemble_fusion_parts(daemon);
  parts.labeller = std::make_unique<TimedLabeller>(std::move(parts.labeller), label_us);
  parts.solver = std::make_unique<TimedSolver>(std::move(parts.solver), solve_us);
  fusion::Fusion fusion(std::move(parts), static_cast<std::uint32_t>(daemon.rig.size()));
  Spans spans;
  scoring::LabelScorer names;
  const auto warm_up = static_cast<int>(kWarmUp_s * settings.rate_hz);
  for (int set = 0; set < warm_up + settings.sets; ++set) {
    world.step();
    FrameSet frames;
    frames.number = static_cast<std::uint64_t>(set);
    frames.exposed_at = world.truth().exposed_at;
    frames.expected_views = static_cast<std::uint32_t>(daemon.rig.size());
    for (const BlobFrame& frame : world.frames()) frames.views.push_back(&frame);
    label_us = solve_us = 0.0;
    const Snapshot& snapshot = fusion.step(frames);
    if (set < warm_up && set % kReferenceStep == 0) {
      Spans before;
      time_reference(references, world.performers(), world.t_s(), before);
    }
    if (set < warm_up) continue;
    spans.both_us.push_back(label_us + solve_us);
    spans.label_us.push_back(label_us);
    spans.solve_us.push_back(solve_us);
    scoring::EvalFrame reported = scoring::frame_of(snapshot);
    recognition.apply(world.truth(), reported);
    names.add(world.truth(), reported);
    if (set - warm_up < kReferenceSets) {
      time_reference(references, world.performers(), world.t_s(), spans);
    }
  }
  scoring::LabelCounts all;
  for (const auto& [subject, counts] : names.finish()) all.add(counts);
  SolveBenchFigures figures = figures_of(spans, all, settings);
  figures.markers = markers;
  return figures;
}

}  // namespace mocap::bench
