#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"

namespace mocap::calibration {

enum class BoardKind {
  Chessboard,  ///< found only if all its corners are in the image
  Charuco,     ///< chessboard with ArUco markers: a visible part is enough, so it may extend beyond the image border
};

/// A flat board with a known pattern.
struct Board {
  BoardKind kind = BoardKind::Charuco;
  int columns = 8;  ///< squares, not corners
  int rows = 6;
  double square_m = 0.04;
  double marker_m = 0.03;             ///< side of an ArUco marker; Charuco only
  std::string dictionary = "4x4_50";  ///< ArUco dictionary, by OpenCV's name without DICT_
};

/// A borrowed 8-bit image.
struct GreyImage {
  const std::uint8_t* pixels = nullptr;
  int width_px = 0;
  int height_px = 0;
  std::size_t stride_bytes = 0;
};

/// The inner corners of a board in one image.
struct BoardView {
  std::vector<Eigen::Vector2d> seen_px;  ///< observed
  std::vector<Eigen::Vector2d> board_m;  ///< the same corners on the board
};

/// Finds the corners of one board in images.
class BoardFinder {
 public:
  /// Fails with InvalidArgument if the board is impossible: its sizes, an unknown dictionary, or a dictionary with too
  /// few markers.
  static Result<BoardFinder> make(const Board& board);
  BoardFinder(BoardFinder&&) noexcept;
  BoardFinder& operator=(BoardFinder&&) noexcept;
  ~BoardFinder();

  /// The corners with an error of some hundredths of a pixel (tests/calibration/find_board_test.cpp). Empty if fewer
  /// than 6 corners are found, or if all of them lie on one line.
  BoardView find(const GreyImage& image) const;

 private:
  struct Detector;
  explicit BoardFinder(std::unique_ptr<Detector> detector);

  std::unique_ptr<Detector> detector_;
};

}  // namespace mocap::calibration
