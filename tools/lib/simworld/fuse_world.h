#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "model/blob.h"
#include "model/camera_model.h"
#include "model/skeleton.h"
#include "scene/actor.h"
#include "scene/random.h"

namespace mocap::simworld {

struct FuseWorldSettings {
  int cameras = 8;
  int markers = 40;
  double rate_hz = 120.0;
  double sigma_px = 0.1;      ///< standard deviation of a blob centroid, each axis
  double missed = 0.03;       ///< probability that a view of a marker gives no blob
  double false_blobs = 0.02;  ///< expected number for each marker and image
  std::uint64_t seed = 1;
};

/// Blobs of a ring of cameras with lens distortion around people who walk, wave and crouch: with noise, missed
/// detections, false blobs and merged blobs. Bodies hide no markers.
class FuseWorld {
 public:
  /// Each person has the markers of `marker_set`. There are as many people as `settings.markers` needs.
  FuseWorld(const FuseWorldSettings& settings, const MarkerSet& marker_set);

  const Rig& rig() const { return rig_; }

  /// Simulates set `number`. The first set is 0.
  void step(std::uint64_t number);

  /// The blobs of the current set, by camera.
  const std::vector<std::unique_ptr<BlobFrame>>& frames() const { return frames_; }
  /// The true positions of the markers, and the number of cameras in which each has a blob of its own.
  const std::vector<WorldPoint>& markers() const { return markers_; }
  const std::vector<int>& views() const { return views_; }

 private:
  // A blob and the index of its marker; -1 for a false or merged blob.
  struct Light {
    Blob blob;
    int marker;
  };

  void move(double t_s);
  void look(std::size_t camera);
  static void merge(std::vector<Light>& lights);

  FuseWorldSettings settings_;
  Rig rig_;
  std::vector<std::unique_ptr<scene::Actor>> people_;
  scene::ActorState state_;
  scene::Random random_;
  std::vector<std::unique_ptr<BlobFrame>> frames_;
  std::vector<WorldPoint> markers_;
  std::vector<int> views_;
  std::vector<Light> lights_;
};

}  // namespace mocap::simworld
