#include "bench/scene_cameras.h"

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>

#include "module/camera.h"
#include "module/detector.h"
#include "scene/ring_rig.h"

namespace mocap::bench {
namespace {

// From the middle of the exposure to the arrival of the last byte.
constexpr Duration kTransfer = std::chrono::microseconds(2500);

// Centres of the figures of eight in which the people walk, m.
constexpr std::array<std::array<double, 2>, 3> kPlaces_m{{{0.0, 0.0}, {0.0, 2.4}, {0.0, -2.4}}};

class SceneCamera : public Camera {
 public:
  SceneCamera(CameraId id, SceneBlobs& scene, Timestamp epoch, int width_px, int height_px)
      : id_(id),
        scene_(scene),
        epoch_(epoch),
        width_px_(width_px),
        height_px_(height_px),
        black_(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {}

  Status start() override { return {}; }
  void stop() noexcept override {}

  Result<Frame> next(Duration patience) override {
    const Timestamp exposed_at = epoch_ + from_s(static_cast<double>(next_) / scene_.rate_hz());
    const Timestamp due = exposed_at + kTransfer, now = host_now();
    std::this_thread::sleep_until(std::min(due, now + patience));
    if (due > now + patience) return Error{ErrorCode::Timeout, {}};
    blobs_ = scene_.blobs(next_, id_);
    Frame frame;
    frame.camera = id_;
    frame.number = next_++;
    frame.exposed_at = exposed_at;
    frame.received_at = host_now();
    frame.image = {black_, static_cast<std::size_t>(width_px_), width_px_, height_px_, PixelFormat::Mono8};
    return frame;
  }

  const Blobs& blobs() const noexcept { return blobs_; }

 private:
  CameraId id_;
  SceneBlobs& scene_;
  Timestamp epoch_;
  int width_px_, height_px_;
  std::vector<std::byte> black_;
  std::uint64_t next_ = 0;
  Blobs blobs_;
};

class SceneDetector : public Detector {
 public:
  explicit SceneDetector(const SceneCamera& camera) : camera_(camera) {}
  Detection detect(const Image& /*image*/) override {
    Detection detection;
    detection.blobs = camera_.blobs();
    return detection;
  }

 private:
  const SceneCamera& camera_;
};

}  // namespace

Blobs SceneBlobs::blobs(std::uint64_t number, CameraId camera) {
  const std::lock_guard lock(mutex_);
  for (; next_ <= number; ++next_) {
    world_.step();
    std::vector<Blobs>& set = sets_[next_ % kSets];
    set.resize(world_.frames().size());
    for (std::size_t c = 0; c < set.size(); ++c) set[c] = world_.frames()[c].blobs;
  }
  if (number + kSets < next_) return {};
  return sets_[number % kSets][camera.value];
}

Result<simworld::SceneWorld> make_bench_world(const SceneOfBench& wanted) {
  simworld::SceneFile scene;
  scene.rate_hz = wanted.rate_hz;
  scene.ring = {.cameras = wanted.cameras, .radius_m = 7.0, .height_m = 3.5, .width_px = 1280, .height_px = 1024};
  for (int i = 0; i < wanted.subjects; ++i) {
    simworld::SceneActor& actor = scene.actors.emplace_back();
    actor.name = "subject" + std::to_string(i + 1);
    actor.motion = "tpose:3,walk";
    actor.marker_set = wanted.marker_set;
    actor.place_m = kPlaces_m[static_cast<std::size_t>(i) % kPlaces_m.size()];
    actor.size = 1.0 - 0.03 * i;
  }
  auto performers = simworld::make_performers(scene, "", scene.seed);
  if (!performers) return performers.error();
  Rig rig = scene::ring_rig(scene.ring);
  auto events = simworld::SceneEvents::make(scene, *performers, rig.size(), scene.seed, true);
  if (!events) return events.error();
  return simworld::SceneWorld(scene, std::move(rig), *std::move(performers), *std::move(events), scene.seed);
}

void see_scene(runtime::CameraParts& parts, CameraId id, SceneBlobs& scene, Timestamp epoch) {
  auto camera = std::make_unique<SceneCamera>(id, scene, epoch, parts.expected_width_px, parts.expected_height_px);
  parts.make_detector = [camera = camera.get()](const Image&) -> Result<std::unique_ptr<Detector>> {
    return std::unique_ptr<Detector>(std::make_unique<SceneDetector>(*camera));
  };
  parts.camera = std::move(camera);
}

}  // namespace mocap::bench
