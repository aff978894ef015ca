#include "eval/scene_run.h"

#include <ctime>

#include <algorithm>
#include <memory>
#include <utility>

#include "assemble.h"
#include "eval/blob_pipeline.h"
#include "kinematics/rotation_observability.h"
#include "lib/offline/offline_tracks.h"
#include "lib/simworld/recognition.h"
#include "lib/simworld/scene_world.h"
#include "settings/rig/rig_file.h"
#include "take/snapshot_writer.h"

namespace mocap::eval {
namespace {

Result<Rig> rig_of(const simworld::SceneFile& scene) {
  if (scene.rig_file.empty()) return scene::ring_rig(scene.ring);
  Result<Rig, settings::Faults> rig = settings::load_rig(scene.rig_file);
  if (!rig) return Error{ErrorCode::InvalidArgument, settings::to_text(rig.error())};
  return *std::move(rig);
}

// CPU time of this thread, s.
double thread_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
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

}  // namespace

Result<SceneOutcome> run_scene(const simworld::SceneFile& scene, const std::string& clip,
                               const SceneRunSettings& settings) {
  auto performers = simworld::make_performers(scene, clip, settings.seed);
  if (!performers) return performers.error();
  const auto rig = rig_of(scene);
  if (!rig) return rig.error();
  auto events = simworld::SceneEvents::make(scene, *performers, rig->size(), settings.seed, settings.rays);
  if (!events) return events.error();
  const std::vector<simworld::JointWatch> watches = events->watches();

  settings::DaemonSettings daemon = scene.daemon;
  daemon.rig = *rig;
  for (const simworld::Performer& performer : *performers) daemon.subject_models.push_back(performer.subject);
  SceneOutcome outcome = about(clip, *performers);
  simworld::Recognition recognition(*performers);
  simworld::SceneWorld world(scene, *rig, std::move(*performers), std::move(*events), settings.seed);
  BlobPipeline pipeline(daemon);
  const std::unique_ptr<SearchExplainer> explainer = assemble_explainer(daemon);
  scoring::LabelScorer labels(settings.keeps_plots);
  scoring::SkeletonScorer bones(settings.keeps_plots, outcome.rotation_observability);
  std::unique_ptr<Writer> snapshots;
  if (!settings.snapshots.empty()) {
    auto opened = take::make_snapshot_writer(settings.snapshots, description_of(daemon));
    if (!opened) return opened.error();
    snapshots = *std::move(opened);
  }
  std::unique_ptr<offline::OfflineTracks> offline;
  if (settings.offline) {
    auto created = offline::OfflineTracks::create(daemon, std::filesystem::temp_directory_path());
    if (!created) return created.error();
    offline = *std::move(created);
  }
  std::vector<TrueSet> truths;  // of the sets that are scored at the end
  const auto judge = [&](const TrueSet& set, const Snapshot& snapshot) {
    scoring::EvalFrame reported = scoring::frame_of(snapshot);
    recognition.apply(set.truth, reported);
    labels.add(set.truth, reported);
    bones.add(set.truth, reported);
    judge_watched(watches, set.t_s, set.truth, reported, outcome);
  };
  const auto sets = static_cast<std::uint64_t>(scene.seconds * scene.rate_hz + 0.5);
  for (; outcome.sets < sets; ++outcome.sets) {
    const double begun_s = thread_s();
    world.step();
    const double seen_s = thread_s();
    outcome.world_s += seen_s - begun_s;
    if (world.frames().empty()) continue;  // nothing reaches the daemon
    const Snapshot& snapshot = pipeline.step(world.frames());
    outcome.row_s += thread_s() - seen_s;
    if (const SearchReport* search = pipeline.search()) {
      const SearchHealth why = explainer->explain(*search, sights_of(world.frames(), daemon.rig.size()));
      if (why.cause != SearchCause::None) {
        outcome.reasons.push_back({world.t_s(), why.subject.value, why.cause, std::string(text_of(why.sentence))});
      }
    }
    if (snapshots) {
      if (pipeline.fit()) static_cast<void>(snapshots->learn(*pipeline.fit()));
      if (const Status written = snapshots->write(snapshot); !written) return written.error();
    }
    if (!offline) {
      judge({world.t_s(), world.truth()}, snapshot);
      continue;
    }
    if (const Status kept = offline->add(pipeline.set()); !kept) return kept.error();
    truths.push_back({world.t_s(), world.truth()});
  }
  if (offline) {
    if (const Status tracked = offline->finish([](double) {}); !tracked) return tracked.error();
    for (std::size_t i = 0; i < truths.size(); ++i) {
      const Result<Snapshot> snapshot = offline->snapshot(i);
      if (!snapshot) return snapshot.error();
      judge(truths[i], *snapshot);
    }
  }
  if (snapshots) {
    if (const Status finished = snapshots->finish(); !finished) return finished.error();
  }
  outcome.labels = labels.finish();
  outcome.bones = bones.counts();
  outcome.each_bone = bones.bones();
  outcome.timelines = labels.timelines();
  outcome.errors = bones.errors();
  outcome.wrong = labels.wrong_events();
  outcome.mot = labels.mot();
  outcome.unlabelled = labels.unlabelled();
  outcome.ghosts = labels.ghosts();
  return outcome;
}

}  // namespace mocap::eval
