#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/lens/find_board.h"
#include "calibration/lens/fit_lens.h"
#include "model/frame.h"

namespace mocap::calibrate {

/// An 8-bit image that owns its pixels.
struct GreyPixels {
  std::vector<std::uint8_t> bytes;
  int width_px = 0;
  int height_px = 0;

  calibration::GreyImage view() const {
    return {bytes.data(), width_px, height_px, static_cast<std::size_t>(width_px)};
  }
};

/// The brightness of an image. Fails with Unsupported for packed formats and raw colour.
Result<GreyPixels> grey_of(const Image& image);
/// Reads an image file. Fails with Io if it is no image.
Result<GreyPixels> read_grey(const std::filesystem::path& file);

/// The image files of one camera, sorted by name: those in `folder`/`camera` if it exists, else those in `folder`.
/// Fails with NotFound if there are none.
Result<std::vector<std::filesystem::path>> images_of(const std::filesystem::path& folder, const std::string& camera);

/// Collects views of a board in one camera. A view is kept only if the board is elsewhere than in all views before.
class LensViews {
 public:
  LensViews(const calibration::BoardFinder& finder, std::size_t max_views) : finder_(finder), max_views_(max_views) {}

  /// Adds an image. Fails with InvalidArgument if its size differs from the images before.
  Status add(const GreyPixels& image);

  bool full() const { return views_.size() >= max_views_; }
  std::size_t images() const { return images_; }
  std::size_t found() const { return found_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  const std::vector<calibration::BoardView>& views() const { return views_; }
  calibration::LensCoverage coverage() const { return calibration::coverage_of(views_, width_px_, height_px_); }

 private:
  using Outline = std::array<Eigen::Vector2d, 4>;  ///< approximate outer corners of the board in the image

  bool is_new(const Outline& outline) const;

  const calibration::BoardFinder& finder_;
  std::size_t max_views_;
  std::size_t images_ = 0;
  std::size_t found_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<calibration::BoardView> views_;
  std::vector<Outline> outlines_;
};

/// The 8 x 8 cells of an image as lines of text: "." for an empty cell, and a darker character for more corners.
std::string coverage_map(const calibration::LensCoverage& coverage, const std::string& indent);

}  // namespace mocap::calibrate
