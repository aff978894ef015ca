#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "lib/simworld/scene_world.h"

namespace mocap::simworld {

/// A sudden rotation and displacement of one camera, in random directions.
struct Bump {
  double turn_deg = 0.3;
  double move_mm = 5.0;
  double at_s = 5.0;
};

/// A scene in which the camera poses agree with the rig until one camera is bumped. The motion continues. The same
/// scene and seed give the same world.
class DriftWorld {
 public:
  /// Fails if a rig, motion or marker set file of the scene cannot be used.
  static Result<DriftWorld> make(const SceneFile& scene, const Bump& bump, std::uint64_t seed);

  void step();

  double t_s() const { return before_->t_s(); }
  bool bumped() const { return t_s() >= at_s_; }
  /// The blobs of the current set, by camera.
  const std::vector<BlobFrame>& frames() const { return bumped() ? after_->frames() : before_->frames(); }

  const Rig& rig() const { return before_->rig(); }   ///< poses before the bump
  const Rig& truth() const { return after_->rig(); }  ///< poses after the bump
  std::uint32_t camera() const { return camera_; }    ///< index of the bumped camera
  std::vector<Subject> subjects() const;

 private:
  DriftWorld() = default;

  // The same motion seen by two rigs. frames() reads the world that is valid at the current time.
  std::unique_ptr<SceneWorld> before_;
  std::unique_ptr<SceneWorld> after_;
  std::uint32_t camera_ = 0;
  double at_s_ = 0.0;
};

}  // namespace mocap::simworld
