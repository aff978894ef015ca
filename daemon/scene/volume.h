#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/time.h"
#include "model/snapshot.h"
#include "scene/actor.h"
#include "scene/occlusion.h"
#include "scene/render.h"

namespace mocap::scene {

/// The simulated volume: somebody who moves, seen by cameras. It knows no clock; whoever uses it says what time it is
/// in the motion. Any thread may ask.
class Volume {
 public:
  Volume(std::unique_ptr<Actor> actor, Rig rig, ImageSettings settings);

  const Rig& rig() const { return rig_; }
  const ImageSettings& settings() const { return settings_; }
  const Actor& actor() const { return *actor_; }

  /// Whether a camera sees a marker: there, before the camera, in the image, and not hidden by the body.
  bool sees(std::size_t camera, const ActorState& state, std::size_t marker) const;

  /// The truth at one instant, `t_s` in the motion. A marker that no camera sees is Filled; one that the motion does
  /// not know is Lost. Bones are Measured where the motion knows them. Instants: exposed_at only.
  void truth(double t_s, Timestamp exposed_at, std::uint64_t number, Snapshot& into) const;

 private:
  std::unique_ptr<Actor> actor_;
  Rig rig_;
  ImageSettings settings_;
  Flesh flesh_;
  std::vector<Eigen::Vector3d> eyes_m_;
};

/// One camera of a volume: draws what it sees. One thread owns it; the volume outlives it.
class Eye {
 public:
  /// `noise` tells apart the noise of cameras that share a seed.
  Eye(const Volume& volume, std::size_t camera, std::uint64_t noise);
  Eye(const Volume& volume, std::size_t camera) : Eye(volume, camera, camera) {}

  /// Draws image `number`, whose exposure of `exposure_s` has its middle `t_s` in the motion.
  /// Allocates nothing after the first call.
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
