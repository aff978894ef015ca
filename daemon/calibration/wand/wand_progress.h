#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "calibration/image_cells.h"
#include "calibration/wand/instants.h"
#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// When a recording is complete. Chosen by hand; not yet measured.
struct WandProgressSettings {
  bool lens_known = true;
  std::size_t min_samples = 300;  ///< of each camera, shared with another camera
  double min_coverage = 0.5;      ///< fraction of the image cells
  /// With so many samples the coverage is not required: the rest of the image shows places that the wand cannot reach.
  std::size_t samples_without_coverage = 1200;
  Duration max_skew = kMaxSkew;  ///< largest difference of exposure times within an instant
};

/// The progress of one camera.
struct CameraProgress {
  std::size_t images = 0;
  std::size_t samples = 0;  ///< images with a detected wand
  std::size_t shared = 0;   ///< of these, at instants at which another camera detected the wand, too
  double coverage = 0.0;    ///< fraction of the 8 x 8 image cells with a marker
  std::array<std::uint32_t, kImageCells * kImageCells> cells{};  ///< markers by image cell, row by row
  std::string least_covered;  ///< region of the image in words; empty if every region is covered
  bool is_connected = false;  ///< shares enough samples with the first camera, directly or through others
};

/// Measures the progress of a wand recording while it is made, and advises the operator. A complete recording is worth
/// solving; whether it can be solved is decided by solve_wand, which checks more. One thread.
class WandProgress {
 public:
  /// The rig gives image sizes and intrinsics.
  WandProgress(Rig rig, Wand wand, const WandProgressSettings& settings);

  /// Adds an image. The images of one camera must come in the order of their exposure, those of several in any order.
  void add(std::size_t camera, const Picture& image);

  CameraProgress progress_of(std::size_t camera) const;
  bool is_complete() const;
  /// Shared samples that each camera needs.
  std::size_t min_samples() const { return settings_.min_samples; }
  /// Advice to the operator about the camera with the least progress; empty if the recording is complete.
  std::string advice() const;

 private:
  struct Camera {
    std::size_t images = 0;
    std::size_t shared = 0;
    std::vector<std::pair<Timestamp, bool>> samples;  // exposure, and whether another camera shares the sample
    std::array<std::uint32_t, kImageCells * kImageCells> cells{};
  };

  bool is_complete(const CameraProgress& camera) const;
  std::vector<bool> connected_cameras() const;

  Rig rig_;
  Wand wand_;
  WandProgressSettings settings_;
  WandTolerance tolerance_;
  std::vector<Camera> cameras_;
  std::vector<std::size_t> shared_samples_;  // camera x camera
  std::vector<Eigen::Vector2d> undistorted_px_;
  std::vector<std::size_t> index_;
};

}  // namespace mocap::calibration
