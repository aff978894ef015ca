#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "base/result.h"
#include "chaos/episode.h"
#include "lib/simworld/scene_world.h"

namespace mocap::chaos {

/// The simulated world of an episode: people who walk and wave in a ring of cameras.
class Stage {
 public:
  /// Fails with NotFound if the shipped marker sets are missing.
  static Result<Stage> make(const Episode& episode);

  const Rig& rig() const { return world_->rig(); }
  std::vector<Subject> subjects() const;

  void step() { world_->step(); }
  double t_s() const { return world_->t_s(); }
  const std::vector<BlobFrame>& frames() const { return world_->frames(); }
  const scoring::EvalFrame& truth() const { return world_->truth(); }

 private:
  explicit Stage(std::unique_ptr<simworld::SceneWorld> world) : world_(std::move(world)) {}

  std::unique_ptr<simworld::SceneWorld> world_;
};

}  // namespace mocap::chaos
