#include "eval/scene_run.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "assemble.h"
#include "eval/blob_pipeline.h"
#include "eval/scored_part.h"
#include "kinematics/rotation_observability.h"
#include "lib/offline/offline_tracks.h"
#include "lib/simworld/recognition.h"
#include "lib/simworld/scene_world.h"
#include "lib/thread_time.h"
#include "settings/rig/rig_file.h"
#include "take/recordings/snapshot_writer.h"

namespace mocap::eval {
namespace {

Result<Rig> rig_of(const simworld::SceneFile& scene) {
  if (scene.rig_file.empty()) return scene::ring_rig(scene.ring);
  Result<Rig, settings::Faults> rig = settings::load_rig(scene.rig_file);
  if (!rig) return Error{ErrorCode::InvalidArgument, settings::to_text(rig.error())};
  return *std::move(rig);
}

struct TrueSet {
  double t_s = 0.0;
  scoring::EvalFrame truth;
};

void judge_watched(const std::vector<simworld::JointWatch>& watches, double t_s, const scoring::EvalFrame& truth,
                   const scoring::EvalFrame& reported, SceneOutcome& outcome) {
  for (const simworld::JointWatch& watch : watches) {
    if (!watch.span.has(t_s)) continue;
    const auto is_it = [&](const scoring::PosedBone& b) { return b.subject == watch.subject && b.bone == watch.bone; };
    const auto own = std::ranges::find_if(truth.bones, is_it);
    const auto bone = std::ranges::find_if(reported.bones, is_it);
    if (own == truth.bones.end() || bone == reported.bones.end()) continue;
    outcome.watched_squares_m2 += (bone->position_m - own->position_m).squaredNorm();
    ++outcome.watched;
  }
}

// The detector's counts of one set of blobs, as the cameras of the daemon report them.
std::vector<CameraSight> sights_of(const std::vector<BlobFrame>& frames, std::size_t camera_count) {
  std::vector<CameraSight> sights(camera_count);
  for (const BlobFrame& frame : frames) {
    CameraSight& sight = sights[frame.camera.value];
    sight.images = 1;
    sight.detection.blobs = frame.blobs.size();
  }
  return sights;
}

SceneOutcome about(const std::string& clip, const std::vector<simworld::Performer>& performers) {
  SceneOutcome outcome;
  outcome.clip = clip;
  for (const simworld::Performer& performer : performers) {
    outcome.subjects.push_back(performer.subject.name);
    std::vector<std::string>& names = outcome.marker_names.emplace_back();
    for (const MarkerOnBone& marker : performer.subject.marker_set.markers) names.push_back(marker.name);
    std::vector<std::string>& bones = outcome.bone_names.emplace_back();
    for (const Bone& bone : performer.subject.marker_set.skeleton.bones) bones.push_back(bone.name);
    outcome.rotation_observability.push_back(kinematics::rotation_observability(performer.subject.marker_set));
  }
  return outcome;
}

Description description_of(const settings::DaemonSettings& settings) {
  Description description;
  description.producer = "mocap-eval";
  description.nominal_rate_hz = settings.nominal_rate_hz;
  description.cameras = settings.rig;
  description.subjects = settings.subject_models;
  return description;
}

/// Scores what the pipeline reports of one clip.
class Scorer {
 public:
  Scorer(const std::vector<simworld::Performer>& performers, ScoredPart part, std::vector<simworld::JointWatch> watches,
         const SceneRunSettings& settings, SceneOutcome& outcome)
      : recognition_(performers),
        part_(std::move(part)),
        watches_(std::move(watches)),
        labels_(settings.keeps_plots),
        bones_(settings.keeps_plots, outcome.rotation_observability),
        outcome_(outcome) {}

  void judge(const TrueSet& set, const Snapshot& snapshot) {
    scoring::EvalFrame reported = scoring::frame_of(snapshot);
    recognition_.apply(set.truth, reported);
    const scoring::EvalFrame true_part = part_.of(set.truth), reported_part = part_.of(reported);
    labels_.add(true_part, reported_part);
    bones_.add(true_part, reported_part);
    judge_watched(watches_, set.t_s, set.truth, reported, outcome_);
  }

  void finish() {
    outcome_.labels = labels_.finish();
    outcome_.bones = bones_.counts();
    outcome_.each_bone = bones_.bones();
    outcome_.timelines = labels_.timelines();
    outcome_.errors = bones_.errors();
    outcome_.wrong = labels_.wrong_events();
    outcome_.mot = labels_.mot();
    outcome_.unlabelled = labels_.unlabelled();
    outcome_.ghosts = labels_.ghosts();
  }

 private:
  simworld::Recognition recognition_;
  ScoredPart part_;
  std::vector<simworld::JointWatch> watches_;
  scoring::LabelScorer labels_;
  scoring::SkeletonScorer bones_;
  SceneOutcome& outcome_;
};

/// The daemon's pipeline over the sets of one clip.
class SceneRun {
 public:
  SceneRun(const settings::DaemonSettings& daemon, simworld::SceneWorld world, Scorer scorer, SceneOutcome& outcome)
      : camera_count_(daemon.rig.size()),
        world_(std::move(world)),
        pipeline_(daemon),
        explainer_(assemble_explainer(daemon)),
        scorer_(std::move(scorer)),
        outcome_(outcome) {}

  Status open(const settings::DaemonSettings& daemon, const SceneRunSettings& settings) {
    if (!settings.snapshots.empty()) {
      auto opened = take::make_snapshot_writer(settings.snapshots, description_of(daemon));
      if (!opened) return opened.error();
      snapshots_ = *std::move(opened);
    }
    if (settings.offline) {
      auto created = offline::OfflineTracks::create(daemon, std::filesystem::temp_directory_path());
      if (!created) return created.error();
      offline_ = *std::move(created);
    }
    return {};
  }

  Status step() {
    const double begun_s = to_s(thread_time());
    world_.step();
    const double seen_s = to_s(thread_time());
    outcome_.world_s += seen_s - begun_s;
    ++outcome_.sets;
    if (world_.frames().empty()) return {};  // nothing reaches the daemon
    const Snapshot& snapshot = pipeline_.step(world_.frames());
    outcome_.pipeline_s += to_s(thread_time()) - seen_s;
    explain();
    if (Status written = write(snapshot); !written) return written;
    if (!offline_) {
      scorer_.judge({world_.t_s(), world_.truth()}, snapshot);
      return {};
    }
    truths_.push_back({world_.t_s(), world_.truth()});
    return offline_->add(pipeline_.set());
  }

  Status finish() {
    if (offline_) {
      if (Status tracked = offline_->finish([](double) { return true; }); !tracked) return tracked;
      for (std::size_t i = 0; i < truths_.size(); ++i) {
        const Result<Snapshot> snapshot = offline_->snapshot(i);
        if (!snapshot) return snapshot.error();
        scorer_.judge(truths_[i], *snapshot);
      }
    }
    scorer_.finish();
    return snapshots_ ? snapshots_->finish() : Status{};
  }

 private:
  void explain() {
    const SearchReport* search = pipeline_.search();
    if (search == nullptr) return;
    const SearchHealth why = explainer_->explain(*search, sights_of(world_.frames(), camera_count_));
    if (why.cause == SearchCause::None) return;
    outcome_.reasons.push_back({world_.t_s(), why.subject.value, why.cause, std::string(text_of(why.sentence))});
  }

  Status write(const Snapshot& snapshot) {
    if (!snapshots_) return {};
    if (pipeline_.fit()) static_cast<void>(snapshots_->learn(*pipeline_.fit()));
    return snapshots_->write(snapshot);
  }

  std::size_t camera_count_;
  simworld::SceneWorld world_;
  BlobPipeline pipeline_;
  std::unique_ptr<SearchExplainer> explainer_;
  Scorer scorer_;
  SceneOutcome& outcome_;
  std::unique_ptr<Writer> snapshots_;                // null: none are written
  std::unique_ptr<offline::OfflineTracks> offline_;  // null: live
  std::vector<TrueSet> truths_;                      // offline: of the sets that are scored at the end
};

}  // namespace

Result<SceneOutcome> run_scene(const simworld::SceneFile& scene, const std::string& clip,
                               const SceneRunSettings& settings) {
  auto performers = simworld::make_performers(scene, clip, settings.seed);
  if (!performers) return performers.error();
  const auto rig = rig_of(scene);
  if (!rig) return rig.error();
  auto events = simworld::SceneEvents::make(scene, *performers, rig->size(), settings.seed, settings.rays);
  if (!events) return events.error();
  auto part = ScoredPart::make(scene.score.below, *performers);
  if (!part) return part.error();
  settings::DaemonSettings daemon = scene.daemon;
  daemon.rig = *rig;
  for (const simworld::Performer& performer : *performers) daemon.subject_models.push_back(performer.subject);

  SceneOutcome outcome = about(clip, *performers);
  Scorer scorer(*performers, *std::move(part), events->watches(), settings, outcome);
  simworld::SceneWorld world(scene, *rig, std::move(*performers), std::move(*events), settings.seed);
  SceneRun run(daemon, std::move(world), std::move(scorer), outcome);
  if (const Status opened = run.open(daemon, settings); !opened) return opened.error();
  const auto sets = static_cast<std::uint64_t>(scene.seconds * scene.rate_hz + 0.5);
  while (outcome.sets < sets) {
    if (const Status stepped = run.step(); !stepped) return stepped.error();
  }
  if (const Status finished = run.finish(); !finished) return finished.error();
  return outcome;
}

}  // namespace mocap::eval
