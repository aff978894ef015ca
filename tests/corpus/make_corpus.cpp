#include "corpus/make_corpus.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/install_folders.h"
#include "chaos/stage.h"
#include "corpus/cut_images.h"
#include "lib/simworld/scene_world.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/subject_file.h"
#include "support/places.h"

namespace mocap::corpus {
namespace {

namespace fs = std::filesystem;
using chaos::Arrival;
using chaos::Episode;
using chaos::Fault;
using chaos::FaultKind;

constexpr Duration kAfterEnd = std::chrono::milliseconds(500);
constexpr std::uint64_t kTruthEvery = 4;  // sets: enough for the figures, and small
constexpr double kMotionRate_hz = 60.0, kMotion_s = 1.5;

double rounded(double value, double steps) { return std::isfinite(value) ? std::round(value * steps) / steps : value; }

void round_blobs(Arrival& arrival) {
  for (Blob& blob : arrival.blobs) {
    blob.centroid = {{rounded(blob.centroid.v.x(), 32.0), rounded(blob.centroid.v.y(), 32.0)}};
    blob.sigma_px = std::max(rounded(blob.sigma_px, 64.0), 1.0 / 64.0);
    blob.area_px2 = std::max(rounded(blob.area_px2, 0.25), 4.0);
    blob.peak = rounded(blob.peak, 8.0);
    blob.roundness = rounded(blob.roundness, 8.0);
    blob.axis_rad = rounded(blob.axis_rad, 4.0);
    blob.saturated = rounded(blob.saturated, 4.0);
  }
}

Truth truth_of(const scoring::EvalFrame& frame) {
  Truth truth{frame.exposed_at, {}};
  for (const scoring::NamedMarker& marker : frame.markers) {
    TrueMarker& there = truth.markers.emplace_back();
    there.subject = static_cast<std::uint8_t>(marker.subject);
    there.marker = static_cast<std::uint8_t>(marker.marker);
    for (int axis = 0; axis < 3; ++axis) there.position_m[axis] = static_cast<float>(marker.position_m[axis]);
  }
  return truth;
}

// The time from which the host works again, if it stalls at `at`.
Timestamp handled_at(const Episode& episode, Timestamp at) {
  const Fault* stall = chaos::active_fault(episode.faults, FaultKind::HostStalls, 0, to_s(at - kFirstExposure));
  return stall == nullptr ? at : kFirstExposure + from_s(stall->to_s());
}

OrderKind reload_of(const Fault& fault) {
  return std::array{OrderKind::ReloadSame, OrderKind::ReloadLabel, OrderKind::ReloadAlign}.at(
      static_cast<std::size_t>(fault.amount));
}

// The orders to which a fault leads, as EpisodeRun follows it; faults of the feed are kept as they are.
void add_orders(const Fault& fault, Recording& recording) {
  const auto add = [&](double t_s, OrderKind kind, double amount = 0.0) {
    recording.inputs.push_back({kFirstExposure + from_s(t_s), Order{kind, fault.target, amount}});
  };
  const double from_s = fault.from_s, to_s = fault.to_s();
  switch (fault.kind) {
    case FaultKind::Unplugged: return add(from_s, OrderKind::Lose);
    case FaultKind::SubjectReset: return add(from_s, OrderKind::Reset);
    case FaultKind::SubjectRemoved: add(from_s, OrderKind::Away); return add(to_s, OrderKind::Back);
    case FaultKind::Reload: return add(from_s, reload_of(fault));
    case FaultKind::TakeRecorded:
      add(from_s, OrderKind::TakeStart, fault.amount);
      return add(to_s, OrderKind::TakeStop);
    case FaultKind::TakeNext: return add(from_s, OrderKind::TakeNext);
    case FaultKind::TakeCancelled: return add(from_s, OrderKind::TakeCancel);
    case FaultKind::TakeCut: return add(from_s, OrderKind::TakeCut, fault.amount);
    case FaultKind::DiskFull:
      add(from_s, OrderKind::DiskFull, std::round(fault.amount));
      return add(to_s, OrderKind::DiskFree);
    case FaultKind::FolderGone: return add(from_s, OrderKind::FolderGone);
    case FaultKind::PublisherStalls:
    case FaultKind::MessagesLost:
    case FaultKind::MessagesCut: recording.feed_faults.push_back(fault); return;
    default: return;  // in the images already
  }
}

Recording recording_of(const Episode& episode) {
  Recording recording;
  recording.rate_hz = episode.rate_hz;
  recording.utc_stamps = episode.utc_stamps;
  recording.patience = episode.patience;
  recording.seed = episode.seed;
  for (const Fault& fault : episode.faults) {
    recording.about += chaos::to_text(fault) + "\n";
    add_orders(fault, recording);
  }
  return recording;
}

// Exposes the cameras to a world from `first_s` until the end of the episode. World: chaos::Stage or SceneWorld.
template <class World>
void expose(World& world, double first_s, const Episode& episode, Recording& recording) {
  chaos::FaultyCameras cameras(episode, world.rig());
  const auto take_up_to = [&](Timestamp until) {
    while (auto arrival = cameras.next(until)) {
      round_blobs(*arrival);
      recording.inputs.push_back({handled_at(episode, arrival->received), *std::move(arrival)});
    }
  };
  const double period_s = 1.0 / episode.rate_hz;
  const auto before = static_cast<std::uint64_t>(first_s * episode.rate_hz);
  for (std::uint64_t i = 0; i < before; ++i) world.step();
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(episode.seconds * episode.rate_hz); ++i) {
    world.step();
    cameras.expose(world.frames(), world.t_s());
    if (i % kTruthEvery == 0) recording.truths.push_back(truth_of(world.truth()));
    take_up_to(kFirstExposure + from_s(world.t_s() + period_s));
  }
  take_up_to(kFirstExposure + from_s(world.t_s()) + kAfterEnd);
  std::ranges::stable_sort(recording.inputs, {}, &Input::at);
}

// The scene of a motion: its body is known to the daemon.
simworld::SceneFile scene_of(const MotionPlan& plan) {
  simworld::SceneFile scene;
  scene.path = fs::path(support::source_folder()) / "config/scenes/corpus.toml";  // from where the motion is searched
  scene.rate_hz = kMotionRate_hz;
  simworld::SceneActor& actor = scene.actors.emplace_back();
  actor.name = plan.body;
  actor.motion = plan.motion;
  actor.marker_set = install_folders().data / "markersets" / (plan.given + ".toml");
  actor.t_pose_s = 0.0;
  actor.stored = true;
  actor.fit = plan.fit;
  return scene;
}

Status write_body(const MotionPlan& plan, const fs::path& world) {
  auto performers = simworld::make_performers(scene_of(plan), "", 1);
  if (!performers) return performers.error();
  const fs::path marker_set = world / "markersets" / (plan.body + ".toml");
  settings::SubjectFile subject;
  subject.name = plan.body;
  subject.marker_set_file = marker_set;
  subject.marker_set = performers->front().subject.marker_set;
  subject.marker_set.name = plan.body;
  subject.fitted_on = "2026-01-01T00:00:00Z";  // the same in each generation
  if (Status saved = settings::save_marker_set(marker_set, subject.marker_set, world / "skeletons/human18.toml");
      !saved) {
    return saved;
  }
  return settings::save_subject(world / "subjects" / (plan.body + ".toml"), subject);
}

// The rig and the bodies as they are now, so that a later change of the shipped files does not change the corpus.
Status write_world(const fs::path& world, const Rig& rig) {
  std::error_code failed;
  const fs::path shipped = install_folders().data;
  for (const char* part : {"markersets", "skeletons", "subjects"}) fs::create_directories(world / part, failed);
  for (const char* file : {"markersets/openmocap18.toml", "markersets/baseline41.toml", "skeletons/human18.toml"}) {
    fs::copy_file(shipped / file, world / file, fs::copy_options::overwrite_existing, failed);
    if (failed) return Error{ErrorCode::Io, fmt::format("{}: {}", (world / file).string(), failed.message())};
  }
  for (const MotionPlan& plan : motion_plans()) {
    if (plan.fit.empty()) continue;
    if (Status written = write_body(plan, world); !written) return written;
  }
  return settings::save_rig(world / "rig.toml", rig, {});
}

}  // namespace

Result<Recording> simulate(const Episode& episode) {
  Result<chaos::Stage> stage = chaos::Stage::make(episode);
  if (!stage) return stage.error();
  Recording recording = recording_of(episode);
  for (const Subject& subject : stage->subjects()) recording.bodies.push_back(subject.marker_set.name);
  expose(*stage, 0.0, episode, recording);
  return recording;
}

Result<Recording> simulate(const MotionPlan& plan) {
  const simworld::SceneFile scene = scene_of(plan);
  auto performers = simworld::make_performers(scene, "", 1);
  if (!performers) return performers.error();
  Rig rig = scene::ring_rig(scene.ring);
  auto events = simworld::SceneEvents::make(scene, *performers, rig.size(), 1, true);
  if (!events) return events.error();
  Episode episode;
  episode.rate_hz = kMotionRate_hz;
  episode.seconds = kMotion_s;
  Recording recording = recording_of(episode);
  recording.about = fmt::format("{} from {} s", plan.motion, plan.first_s);
  recording.bodies = {plan.body};
  simworld::SceneWorld world(scene, std::move(rig), *std::move(performers), *std::move(events), 1);
  expose(world, plan.first_s, episode, recording);
  return recording;
}

Status make_corpus(const fs::path& folder) {
  const auto make = [&](const auto& of, const std::string& name) -> Status {
    const Result<Recording> recording = simulate(of);
    if (!recording) return recording.error();
    return write_recording(folder / (name + ".mcap"), *recording);
  };
  for (const Plan& plan : plans()) {
    if (Status made = make(plan.episode, plan.name); !made) return made;
  }
  for (const MotionPlan& plan : motion_plans()) {
    if (Status made = make(plan, plan.name); !made) return made;
  }
  if (Status cut = cut_images(folder); !cut) return cut;
  const Result<chaos::Stage> stage = chaos::Stage::make(plans().front().episode);
  if (!stage) return stage.error();
  return write_world(folder / "world", stage->rig());
}

}  // namespace mocap::corpus
