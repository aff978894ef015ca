#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/time.h"
#include "model/snapshot.h"
#include "scene/actor.h"
#include "scene/occlusion.h"
#include "scene/render.h"

namespace mocap::scene {

/// The simulated volume: an actor and the cameras that observe it. Reads no clock: the time in the motion is an
/// argument. Any thread may call.
class Volume {
 public:
  Volume(std::unique_ptr<Actor> actor, Rig rig, ImageSettings settings);

  const Rig& rig() const { return rig_; }
  const ImageSettings& settings() const { return settings_; }
  const Actor& actor() const { return *actor_; }

  /// Whether a marker is visible in a camera: it has a position, is in front of the camera and within the image, and
  /// the body does not hide it.
  bool sees(std::size_t camera, const ActorState& state, std::size_t marker) const;

  /// Writes the true state `t_s` after the start of the motion. A marker that no camera sees is Filled; a marker
  /// without a position is Lost. Bones of the motion are Measured. Only `exposed_at` of the instants is set.
  void truth(double t_s, Timestamp exposed_at, std::uint64_t number, Snapshot& into) const;

 private:
  std::unique_ptr<Actor> actor_;
  Rig rig_;
  ImageSettings settings_;
  Flesh flesh_;
  std::vector<Eigen::Vector3d> eyes_m_;
};

/// Draws the images of one camera of a volume. One thread owns an Eye; the volume outlives it.
class Eye {
 public:
  /// `noise` selects the noise of this camera among cameras with the same seed.
  Eye(const Volume& volume, std::size_t camera, std::uint64_t noise);
  Eye(const Volume& volume, std::size_t camera) : Eye(volume, camera, camera) {}

  /// Draws image `number` with an exposure of `exposure_s` around the time `t_s` of the motion. Allocates nothing after
  /// the first call.
  void see(double t_s, double exposure_s, std::uint64_t number, std::span<std::byte> pixels);

 private:
  void add(const WorldPoint& begin, const WorldPoint& middle, const WorldPoint& end);

  const Volume& volume_;
  std::size_t camera_;
  Renderer renderer_;
  ActorState begin_, middle_, end_;
  std::vector<WorldPoint> clutter_;
  std::vector<Disc> discs_;
};

}  // namespace mocap::scene
