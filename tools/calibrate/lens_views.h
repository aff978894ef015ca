#pragma once

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

/// An 8-bit image of one's own.
struct GreyPixels {
  std::vector<std::uint8_t> bytes;
  int width_px = 0;
  int height_px = 0;

  calibration::GreyImage view() const {
    return {bytes.data(), width_px, height_px, static_cast<std::size_t>(width_px)};
  }
};

/// The brightness of a camera's image. Fails with Unsupported for packed formats and raw colour.
Result<GreyPixels> grey_of(const Image& image);
/// Fails with Io where the file is no image.
Result<GreyPixels> read_grey(const std::filesystem::path& file);

/// One camera's images: those in `folder`/`camera`, else in `folder` itself; by their names' order. Fails with
/// NotFound.
Result<std::vector<std::filesystem::path>> images_of(const std::filesystem::path& folder, const std::string& camera);

/// Gathers the boards that one camera sees: those only that stand elsewhere than all before.
class LensViews {
 public:
  LensViews(const calibration::BoardFinder& finder, std::size_t most_views)
      : finder_(finder), most_views_(most_views) {}

  /// Looks for the board. Fails with InvalidArgument where the image has another size than those before.
  Status take(const GreyPixels& image);

  bool full() const { return views_.size() >= most_views_; }
  std::size_t images() const { return images_; }
  std::size_t found() const { return found_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  const std::vector<calibration::BoardView>& views() const { return views_; }
  calibration::LensCoverage coverage() const { return calibration::coverage_of(views_, width_px_, height_px_); }

 private:
  using Outline = std::array<Eigen::Vector2d, 4>;  ///< about where the board's corners are in the image

  bool is_new(const Outline& outline) const;

  const calibration::BoardFinder& finder_;
  std::size_t most_views_;
  std::size_t images_ = 0;
  std::size_t found_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<calibration::BoardView> views_;
  std::vector<Outline> outlines_;
};

/// The 8 x 8 fields of an image as lines of a terminal: "." empty, then the more corners the darker.
std::string coverage_map(const calibration::LensCoverage& coverage, const std::string& indent);

}  // namespace mocap::calibrate
