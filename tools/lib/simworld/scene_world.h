#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "lib/scoring/frames.h"
#include "lib/simworld/drawn_blobs.h"
#include "lib/simworld/scene_actors.h"
#include "lib/simworld/scene_blobs.h"
#include "lib/simworld/scene_events.h"
#include "model/blob.h"
#include "scene/occlusion.h"
#include "scene/random.h"

namespace mocap::simworld {

/// Simulates the blobs of a scene, set by set. The same file, clip and seed give the same world.
class SceneWorld {
 public:
  SceneWorld(const SceneFile& scene, Rig rig, std::vector<Performer> performers, SceneEvents events,
             std::uint64_t seed);

  const Rig& rig() const { return rig_; }
  const std::vector<Performer>& performers() const { return performers_; }

  /// Simulates the next set. The first set is at 0 s.
  void step();

  double t_s() const { return t_s_; }
  /// The blobs of the cameras that deliver an image at this time; may be empty.
  const std::vector<BlobFrame>& frames() const { return frames_; }
  /// The truth of the current set. Each marker has the number of cameras that see it. A bone is Measured if at least
  /// two cameras see one of its markers, else Filled.
  const scoring::EvalFrame& truth() const { return truth_; }

 private:
  struct Light {
    std::uint32_t performer = 0;
    std::uint32_t marker = 0;  // index in the actor's marker set, or kGhost for an unlabelled point
    Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
    std::uint32_t cameras = 0;
  };
  static constexpr std::uint32_t kGhost = 0xFFFF'FFFF;

  void move();
  void look(std::uint32_t camera, Blobs& blobs);
  int false_count(std::size_t lit);
  void add_false_spots(const CameraModel& model);
  bool is_hidden(const Light& light, std::uint32_t camera) const;
  void update_truth();

  double rate_hz_, false_blobs_, radius_m_;
  bool occlusion_;
  Rig rig_;
  std::vector<Eigen::Vector3d> eyes_m_;
  std::vector<Performer> performers_;
  SceneEvents events_;
  std::vector<scene::Flesh> flesh_;
  std::vector<scene::ActorState> states_;
  scene::Random random_;
  BlobMaker maker_;
  std::unique_ptr<DrawnBlobs> drawn_;  // null: blobs come from BlobMaker
  std::uint64_t number_ = 0;
  double t_s_ = 0.0;
  std::vector<Light> lights_;
  std::vector<Spot> spots_;
  std::vector<BlobFrame> frames_;
  scoring::EvalFrame truth_;
};

}  // namespace mocap::simworld
