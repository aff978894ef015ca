#include "metamorphic/recording.h"

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "assemble.h"
#include "base/archive.h"
#include "base/expects.h"
#include "base/log.h"
#include "lib/simworld/scene_world.h"
#include "model/take/belief.h"
#include "support/places.h"
#include "synchronise/frame_aligner.h"
#include "track2d/following_blob_tracker.h"
#include "wire/codec/encode.h"

namespace mocap::metamorphic {
namespace {

constexpr double kRate_hz = 50.0;
constexpr int kSets = 150;

simworld::SceneActor actor(const std::string& name, const std::string& set, const std::string& motion,
                           std::array<double, 2> place_m) {
  simworld::SceneActor actor;
  actor.name = name;
  actor.marker_set = support::source_folder() + "/config/markersets/" + set + ".toml";
  actor.motion = motion;
  actor.place_m = place_m;
  actor.stored = true;
  return actor;
}

simworld::SceneFile scene_file(int scene) {
  simworld::SceneFile file;
  file.rate_hz = kRate_hz;
  file.ring.cameras = 4 + scene % 2;
  file.actors.push_back(actor("one", "baseline41", "tpose:1,walk", {0.3, 0.2}));
  if (scene == 1) file.actors.push_back(actor("two", "openmocap18", "tpose:1,wave", {-0.7, -0.5}));
  if (scene == 2) {
    simworld::SceneHide hide;
    hide.from_s = 1.0;
    hide.share = 0.2;
    file.hides.push_back(hide);
  }
  return file;
}

Recording record(int scene) {
  const simworld::SceneFile file = scene_file(scene);
  auto performers = simworld::make_performers(file, "", 7);
  if (!performers) log_error("metamorphic", performers.error().message);
  MOCAP_EXPECTS(performers.has_value());
  Recording recording;
  recording.settings.rig = scene::ring_rig(file.ring);
  recording.settings.nominal_rate_hz = kRate_hz;
  for (const auto& performer : *performers) recording.settings.subject_models.push_back(performer.subject);
  auto events = simworld::SceneEvents::make(file, *performers, recording.settings.rig.size(), 7, true);
  MOCAP_EXPECTS(events.has_value());
  simworld::SceneWorld world(file, recording.settings.rig, *std::move(performers), *std::move(events), 7);
  for (int i = 0; i < kSets; ++i) {
    world.step();
    for (const BlobFrame& frame : world.frames()) recording.frames.push_back(frame);
  }
  return recording;
}

std::string comparable_bytes(Snapshot snapshot) {
  snapshot.views.clear();
  snapshot.instants = {};
  snapshot.expected_views = snapshot.delivering_cameras = 0;
  v1::Snapshot message;
  wire::encode(snapshot, message);
  return message.SerializeAsString();
}

using Places = std::map<std::pair<std::uint32_t, std::uint32_t>, Eigen::Vector3d>;

Places markers_of(const scoring::EvalFrame& frame) {
  Places places;
  for (const auto& marker : frame.markers) {
    if (marker.state == LabelState::Measured) places[{marker.subject, marker.marker}] = marker.position_m;
  }
  return places;
}

Places bones_of(const scoring::EvalFrame& frame) {
  Places places;
  for (const auto& bone : frame.bones) places[{bone.subject, bone.bone}] = bone.position_m;
  return places;
}

struct Sum {
  double squares_m2 = 0.0;
  std::size_t common = 0, others = 0;

  void add(const Places& expected, const Places& found) {
    for (const auto& [name, at_m] : expected) {
      const auto same = found.find(name);
      if (same == found.end()) {
        ++others;
        continue;
      }
      squares_m2 += (same->second - at_m).squaredNorm();
      ++common;
    }
    others += found.size() > expected.size() ? found.size() - expected.size() : 0;
  }
  double rms_m() const { return common == 0 ? 0.0 : std::sqrt(squares_m2 / static_cast<double>(common)); }
};

// A new fusion that took over the belief.
std::unique_ptr<fusion::Fusion> with_belief_of(fusion::Fusion& before, const settings::DaemonSettings& settings) {
  const Belief belief;
  Archive written = Archive::writer({belief.memory.get(), kMostBeliefBytes});
  before.archive(written);
  MOCAP_EXPECTS(written.ok());
  auto now = assemble_fusion(settings);
  Archive read = Archive::reader({belief.memory.get(), written.size()});
  now->archive(read);
  MOCAP_EXPECTS(read.ok() && read.size() == written.size());
  return now;
}

}  // namespace

Answer answer_to(const Recording& recording, std::size_t sets_per_fusion) {
  const settings::DaemonSettings& settings = recording.settings;
  synchronise::FrameAligner aligner(settings.pipeline.align, settings.rig.size());
  auto fusion = assemble_fusion(settings);
  std::vector<std::unique_ptr<BlobTracker>> trackers;
  for (std::size_t c = 0; c < settings.rig.size(); ++c) {
    trackers.push_back(track2d::make_blob_tracker(settings.track_blobs));
  }
  Answer answer;
  const auto take_sets = [&] {
    while (const auto set = aligner.take(Timestamp::min())) {
      if (sets_per_fusion > 0 && answer.bytes.size() % sets_per_fusion == sets_per_fusion - 1) {
        fusion = with_belief_of(*fusion, settings);
      }
      const Snapshot& snapshot = fusion->step(*set);
      answer.bytes.push_back(comparable_bytes(snapshot));
      answer.frames.push_back(scoring::frame_of(snapshot));
    }
  };
  std::vector<Timestamp> last(settings.rig.size(), Timestamp::min());
  auto tracked = std::make_unique<BlobFrame>();
  for (const BlobFrame& frame : recording.frames) {
    *tracked = frame;
    // A repeated packet is one image: the camera's driver gives it to the tracker once.
    if (frame.exposed_at > std::exchange(last[frame.camera.value], frame.exposed_at)) {
      trackers[frame.camera.value]->track(*tracked);
    }
    aligner.add(*tracked);
    take_sets();
  }
  for (std::uint32_t c = 0; c < settings.rig.size(); ++c) aligner.finish(CameraId{c});
  take_sets();
  return answer;
}

const Recording& recording_of(int scene) {
  static const std::array<Recording, kScenes> all{record(0), record(1), record(2)};
  return all[static_cast<std::size_t>(scene)];
}

const Answer& answer_to_scene(int scene) {
  static const std::array<Answer, kScenes> all{answer_to(recording_of(0)), answer_to(recording_of(1)),
                                               answer_to(recording_of(2))};
  return all[static_cast<std::size_t>(scene)];
}

Difference difference_of(const Answer& original, const Answer& changed, const Mapping& mapping) {
  MOCAP_EXPECTS(original.frames.size() == changed.frames.size());
  Sum markers, bones;
  for (std::size_t i = 0; i < original.frames.size(); ++i) {
    Places expected_markers, expected_bones;
    for (const auto& [name, at_m] : markers_of(original.frames[i])) {
      expected_markers[{mapping.subject(name.first), mapping.marker(name.first, name.second)}] = mapping.position(at_m);
    }
    for (const auto& [name, at_m] : bones_of(original.frames[i])) {
      expected_bones[{mapping.subject(name.first), name.second}] = mapping.position(at_m);
    }
    markers.add(expected_markers, markers_of(changed.frames[i]));
    bones.add(expected_bones, bones_of(changed.frames[i]));
  }
  const std::size_t all = markers.common + markers.others + bones.common + bones.others;
  const double others =
      static_cast<double>(markers.others + bones.others) / static_cast<double>(std::max<std::size_t>(all, 1));
  return {markers.rms_m(), bones.rms_m(), others};
}

}  // namespace mocap::metamorphic
