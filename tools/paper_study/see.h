#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "model/blob.h"
#include "module/detector.h"
#include "paper_study/clip.h"
#include "scene/render.h"

namespace mocap::paper_study {

/// Blobs of one image of a clip.
struct Seen {
  Timestamp at;
  std::vector<Blob> blobs;
};

/// Blobs of a clip by frame, from two detectors.
struct Sightings {
  std::vector<Seen> paper;  ///< from the study's detector
  std::vector<Seen> ours;   ///< from the daemon's detector with default settings
};

/// Draws clips and detects their blobs: 8-bit images, discs of grey 255 with smooth edges on black, partly covered by
/// barriers. Each image is drawn and processed once for all trackers.
class Viewer {
 public:
  Viewer();

  Sightings see(const Clip& clip);

  /// Draws one frame. The pixels are valid until the next call.
  std::span<const std::byte> draw(const Clip& clip, std::size_t frame);

 private:
  scene::Renderer renderer_;
  std::unique_ptr<Detector> paper_, ours_;
  std::vector<std::byte> pixels_;
  std::vector<scene::Disc> discs_;
};

}  // namespace mocap::paper_study
