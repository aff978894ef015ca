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
  Chessboard,  ///< only as a whole: all its corners must be seen
  Charuco,     ///< squares with ArUco markers: a part of it is enough, so that it may reach over the image's rim
};

/// A flat board with a known pattern.
struct Board {
  BoardKind kind = BoardKind::Charuco;
  int columns = 8;  ///< squares, not corners
  int rows = 6;
  double square_m = 0.04;
  double marker_m = 0.03;             ///< side of a marker; Charuco only
  std::string dictionary = "4x4_50";  ///< of the markers, by the name that OpenCV has for it without DICT_
};

/// An 8-bit image; borrowed.
struct GreyImage {
  const std::uint8_t* pixels = nullptr;
  int width_px = 0;
  int height_px = 0;
  std::size_t stride_bytes = 0;
};

/// A board's inner corners in one image.
struct BoardView {
  std::vector<Eigen::Vector2d> seen_px;
  std::vector<Eigen::Vector2d> board_m;  ///< where each lies on the board
};

/// Finds one board in images.
class BoardFinder {
 public:
  /// Fails with InvalidArgument where there can be no such board: sizes, an unknown dictionary or one that is too
  /// small.
  static Result<BoardFinder> make(const Board& board);
  BoardFinder(BoardFinder&&) noexcept;
  BoardFinder& operator=(BoardFinder&&) noexcept;
  ~BoardFinder();

  /// The corners, to some hundredths of a pixel; none where the board is not seen, or fewer than 6 of its corners, or
  /// all on one line.
  BoardView find(const GreyImage& image) const;

 private:
  struct Made;
  explicit BoardFinder(std::unique_ptr<Made> made);

  std::unique_ptr<Made> made_;
};

}  // namespace mocap::calibration
