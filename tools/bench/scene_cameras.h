#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "lib/simworld/scene_file.h"
#include "lib/simworld/scene_world.h"
#include "model/ids.h"
#include "runtime/camera/camera_worker.h"

namespace mocap::bench {

/// The blobs of a simulated scene for several camera threads: each set is simulated once, when the first camera asks.
class SceneBlobs {
 public:
  SceneBlobs(simworld::SceneWorld world, double rate_hz) : world_(std::move(world)), rate_hz_(rate_hz) {}

  /// The blobs of set `number` in one camera. Empty if the set left the memory: the camera is kSets sets late.
  Blobs blobs(std::uint64_t number, CameraId camera);
  double rate_hz() const noexcept { return rate_hz_; }

 private:
  static constexpr std::uint64_t kSets = 64;

  std::mutex mutex_;
  simworld::SceneWorld world_;
  double rate_hz_;
  std::uint64_t next_ = 0;                      // set to be simulated
  std::array<std::vector<Blobs>, kSets> sets_;  // by number modulo kSets, by camera
};

/// A scene of people with one marker set who walk in a ring of cameras.
struct SceneOfBench {
  int cameras = 8;
  int subjects = 2;
  double rate_hz = 120.0;
  std::filesystem::path marker_set;
};

/// Fails as make_performers does.
Result<simworld::SceneWorld> make_bench_world(const SceneOfBench& scene);

/// Parts that replace those of a simulated camera: images in real time from `epoch` on, that are black and whose blobs
/// are those of the scene, so that drawing takes no time from the measured threads. `scene` outlives the parts; the
/// name, the 2D tracker and the counters of `parts` stay.
void see_scene(runtime::CameraParts& parts, CameraId id, SceneBlobs& scene, Timestamp epoch);

}  // namespace mocap::bench
