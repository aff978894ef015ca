#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "lib/simworld/scene_world.h"

namespace mocap::simworld {

/// Somebody bumps into a camera.
struct Bump {
  double turn_deg = 0.3;
  double move_mm = 5.0;
  double at_s = 5.0;
};

/// A scene whose cameras stand as their rig says until one is bumped: people go on meanwhile. The same scene and seed
/// give the same world.
class DriftWorld {
 public:
  /// Fails as the scene's actors do.
  static Result<DriftWorld> make(const SceneFile& scene, const Bump& bump, std::uint64_t seed);

  void step();

  double t_s() const { return before_->t_s(); }
  bool bumped() const { return t_s() >= at_s_; }
  /// What the cameras see, by camera.
  const std::vector<BlobFrame>& frames() const { return bumped() ? after_->frames() : before_->frames(); }

  const Rig& rig() const { return before_->rig(); }   ///< as the file has it
  const Rig& truth() const { return after_->rig(); }  ///< as it is after the bump
  std::uint32_t camera() const { return camera_; }    ///< that is bumped
  std::vector<Subject> subjects() const;

 private:
  DriftWorld() = default;

  // The same people before two rigs: what a set shows is taken from the one or the other.
  std::unique_ptr<SceneWorld> before_;
  std::unique_ptr<SceneWorld> after_;
  std::uint32_t camera_ = 0;
  double at_s_ = 0.0;
};

}  // namespace mocap::simworld
