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

/// What a detector found in one image of a clip.
struct Seen {
  Timestamp at;
  std::vector<Blob> blobs;
};

/// A clip as the two detectors saw it, by frame.
struct Sightings {
  std::vector<Seen> paper;  ///< the study's detector
  std::vector<Seen> ours;   ///< the daemon's, with its default settings
};

/// Draws clips and finds their blobs: 8-bit images, discs of grey 255 with antialiased edges on black, exact where the
/// barriers cut them. Each image is drawn and searched once, for all trackers.
class Viewer {
 public:
  Viewer();

  Sightings see(const Clip& clip);

  /// Draws one frame; the pixels are borrowed until the next call.
  std::span<const std::byte> draw(const Clip& clip, std::size_t frame);

 private:
  scene::Renderer renderer_;
  std::unique_ptr<Detector> paper_, ours_;
  std::vector<std::byte> pixels_;
  std::vector<scene::Disc> discs_;
};

}  // namespace mocap::paper_study
