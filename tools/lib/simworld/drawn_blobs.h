#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lib/simworld/scene_blobs.h"
#include "model/camera_model.h"
#include "module/detector.h"
#include "scene/render.h"

namespace mocap::simworld {

/// Reference for BlobMaker: draws the image and runs the daemon's detector on it. Lights do not move during an
/// exposure.
class DrawnBlobs {
 public:
  DrawnBlobs(const Rig& rig, std::uint64_t seed);

  /// Like BlobMaker::see(), for image `number` of a camera.
  std::span<const std::uint32_t> see(std::size_t camera, std::uint64_t number, std::span<const Spot> spots,
                                     Blobs& into);

 private:
  struct Eye {
    scene::Renderer renderer;
    std::unique_ptr<Detector> detector;
    std::vector<std::byte> pixels;
    int width_px, height_px;
  };

  std::vector<Eye> eyes_;
  std::vector<scene::Disc> discs_;
  std::vector<std::uint32_t> blob_of_;
};

}  // namespace mocap::simworld
