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
  double sigma_px = 0.1;      ///< of each blob's centroid
  double missed = 0.03;       ///< share of the views of a marker that give no blob
  double false_blobs = 0.02;  ///< for each marker and image
  std::uint64_t seed = 1;
};

/// A ring of cameras with bent lenses around people who walk, wave and crouch, and the blobs that the cameras see of
/// them: with noise, misses, false blobs, and one blob for markers that touch. The bodies hide nothing.
class FuseWorld {
 public:
  /// Everybody wears `worn`, until the markers are as many as wanted.
  FuseWorld(const FuseWorldSettings& settings, const MarkerSet& worn);

  const Rig& rig() const { return rig_; }

  /// Goes on to set `number` (the first is 0).
  void step(std::uint64_t number);

  /// What the cameras saw, by camera.
  const std::vector<std::unique_ptr<BlobFrame>>& frames() const { return frames_; }
  /// Where the markers are, and how many cameras show each by a blob of its own.
  const std::vector<WorldPoint>& markers() const { return markers_; }
  const std::vector<int>& views() const { return views_; }

 private:
  // A blob, and the marker it is of; -1: of none, or of more than one.
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
