#include "lib/simworld/faulty_rig.h"

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "lib/simworld/irregular_rig.h"
#include "lib/simworld/scene_world.h"
#include "scene/ring_rig.h"

namespace mocap::simworld {
namespace {

constexpr double kTurned_deg = 3.0;

void turn(CameraModel& camera, double deg, const Eigen::Vector3d& axis) {
  const Eigen::AngleAxisd turned(deg * std::numbers::pi / 180.0, axis);
  const Eigen::Vector3d centre = camera.centre().v;
  camera.camera_from_world.rotation = turned * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
}

void change_lens(CameraModel& camera, scene::Random& random) {
  const bool is_longer = random.uniform() < 0.5;
  const double ratio = is_longer ? 1.25 + 0.35 * random.uniform() : 0.6 + 0.2 * random.uniform();
  camera.lens.fx_px *= ratio;
  camera.lens.fy_px *= ratio;
  camera.lens.distortion[0] += 0.05 * random.normal();
}

// A rig with as many cameras and the same lenses in other places.
Rig other_room(const Rig& rig, scene::Random& random) {
  Rig other = rig;
  for (CameraModel& camera : other) {
    const Eigen::Vector3d eye(3.0 * random.normal(), 3.0 * random.normal(), 1.5 + 2.0 * random.uniform());
    camera.camera_from_world = scene::look_at(eye, Eigen::Vector3d(0.0, 0.0, 1.0) + 0.3 * random_direction(random));
  }
  return other;
}

void keep(const std::vector<BlobFrame>& frames, calibration::Take& take) {
  for (std::size_t c = 0; c < frames.size(); ++c) {
    calibration::Picture& picture = take.cameras[c].emplace_back();
    picture.exposed_at = frames[c].exposed_at;
    for (const Blob& blob : frames[c].blobs) {
      if (!blob.touches_border && !blob.merged) picture.spots.push_back({blob.centroid, blob.sigma_px});
    }
  }
}

void mirror(std::vector<calibration::Picture>& pictures, int width_px) {
  for (calibration::Picture& picture : pictures) {
    for (calibration::Spot& spot : picture.spots) spot.at.v.x() = width_px - 1 - spot.at.v.x();
  }
}

void delay(std::vector<calibration::Picture>& pictures) {
  for (std::size_t i = 0; i + 1 < pictures.size(); ++i) pictures[i].exposed_at = pictures[i + 1].exposed_at;
  if (!pictures.empty()) pictures.pop_back();
}

Result<calibration::Take> record(const SceneFile& scene, const std::string& clip, const Rig& truth, std::uint64_t seed,
                                 double seconds) {
  auto performers = make_performers(scene, clip, seed);
  if (!performers) return performers.error();
  auto events = SceneEvents::make(scene, *performers, truth.size(), seed, true);
  if (!events) return events.error();
  SceneWorld world(scene, truth, std::move(*performers), std::move(*events), seed);
  calibration::Take take;
  take.cameras.resize(truth.size());
  for (auto sets = static_cast<int>(seconds * scene.rate_hz); sets > 0; --sets) {
    world.step();
    keep(world.frames(), take);
  }
  return take;
}

}  // namespace

const char* name_of(PlantedFault fault) {
  switch (fault) {
    case PlantedFault::None: return "none";
    case PlantedFault::Exchanged: return "exchanged";
    case PlantedFault::Turned: return "turned";
    case PlantedFault::UpsideDown: return "upside down";
    case PlantedFault::OtherLens: return "other lens";
    case PlantedFault::OtherRig: return "other rig";
    case PlantedFault::Mirrored: return "mirrored";
    case PlantedFault::Late: return "one frame late";
  }
  return "";
}

Result<FaultyRecording> record_with_fault(const SceneFile& scene, const std::string& clip, PlantedFault fault,
                                          std::uint64_t seed, double seconds) {
  scene::Random random(scene::mixed(seed ^ 0xFA017));
  const auto rig = irregular_rig(scene, random);
  if (!rig) return rig.error();
  FaultyRecording made;
  made.camera = random.bits() % rig->size();
  made.other = (made.camera + 1 + random.bits() % (rig->size() - 1)) % rig->size();
  made.rig = fault == PlantedFault::OtherRig ? other_room(*rig, random) : *rig;
  Rig truth = *rig;
  if (fault == PlantedFault::Turned) turn(truth[made.camera], kTurned_deg, random_direction(random));
  if (fault == PlantedFault::UpsideDown) turn(truth[made.camera], 180.0, Eigen::Vector3d::UnitZ());
  if (fault == PlantedFault::OtherLens) change_lens(truth[made.camera], random);
  auto blobs = record(scene, clip, truth, seed, seconds);
  if (!blobs) return blobs.error();
  made.blobs = *std::move(blobs);
  auto& pictures = made.blobs.cameras[made.camera];
  if (fault == PlantedFault::Exchanged) std::swap(pictures, made.blobs.cameras[made.other]);
  if (fault == PlantedFault::Mirrored) mirror(pictures, truth[made.camera].width_px);
  if (fault == PlantedFault::Late) delay(pictures);
  return made;
}

}  // namespace mocap::simworld
