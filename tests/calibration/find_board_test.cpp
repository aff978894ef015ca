#include "calibration/lens/find_board.h"

#include <gmock/gmock.h>

#include <cmath>

#include "support/board_images.h"

namespace mocap::calibration {
namespace find_board_test {

using support::BoardImages;

constexpr int kWidth_px = 640;
constexpr int kHeight_px = 480;

Lens bent() {
  Lens lens{LensKind::Pinhole, 520.0, 518.0, 322.0, 236.0, {}};
  lens.distortion << -0.18, 0.05, 5e-4, -3e-4, 0.0;
  return lens;
}

GreyImage grey(const std::vector<std::uint8_t>& pixels) { return {pixels.data(), kWidth_px, kHeight_px, kWidth_px}; }

// Rms error of the corners per axis, against the projection of the drawn board.
double error_px(const BoardView& view, const BoardImages& images, const CameraFromWorld& pose,
                const Eigen::Vector2d& origin_m, bool ends_unknown) {
  double best = 1e9;
  for (const bool turned : {false, true}) {
    if (turned && !ends_unknown) continue;
    Eigen::Vector2d last = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& on : view.board_m) last = last.cwiseMax(on);
    double sum = 0.0;
    for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
      const Eigen::Vector2d on = turned ? Eigen::Vector2d(last - view.board_m[i]) : view.board_m[i];
      const auto truth = images.seen(pose, origin_m + on);
      sum += truth ? (*truth - view.seen_px[i]).squaredNorm() : 1e6;
    }
    best = std::min(best, std::sqrt(sum / (2.0 * static_cast<double>(view.seen_px.size()))));
  }
  return best;
}

// A chessboard has no first corner: the finder may start at either end, and may count rows from below.
double chessboard_error_px(const BoardView& view, const BoardImages& images, const CameraFromWorld& pose,
                           const Board& board) {
  const Eigen::Vector2d first(board.square_m, board.square_m);
  BoardView flipped = view;
  for (Eigen::Vector2d& on : flipped.board_m) on.y() = (board.rows - 2) * board.square_m - on.y();
  return std::min(error_px(view, images, pose, first, true), error_px(flipped, images, pose, first, true));
}

TEST(FindBoard, FindsACharucoBoardsCornersToAFewHundredthsOfAPixel) {
  const Board board{BoardKind::Charuco, 8, 6, 0.04, 0.03, "4x4_50"};
  const auto finder = BoardFinder::make(board);
  ASSERT_TRUE(finder) << finder.error().message;
  BoardImages images(bent(), kWidth_px, kHeight_px, board);
  std::mt19937 random(1);
  for (const double tilt : {0.0, 0.3, 0.6}) {
    const CameraFromWorld pose = images.pose({330.0, 250.0}, 0.45, tilt, random);

    const BoardView view = finder->find(grey(images.draw(pose, random)));

    ASSERT_GE(view.seen_px.size(), 25u) << tilt;
    EXPECT_LT(error_px(view, images, pose, Eigen::Vector2d::Zero(), false), 0.12) << tilt;
  }
}

TEST(FindBoard, FindsThePartOfACharucoBoardInsideTheImage) {
  const Board board{BoardKind::Charuco, 8, 6, 0.04, 0.03, "4x4_50"};
  const auto finder = BoardFinder::make(board);
  BoardImages images(bent(), kWidth_px, kHeight_px, board);
  std::mt19937 random(2);
  const CameraFromWorld pose = images.pose({590.0, 430.0}, 0.4, 0.3, random);

  const BoardView view = finder->find(grey(images.draw(pose, random)));

  ASSERT_GE(view.seen_px.size(), 6u);
  EXPECT_LT(view.seen_px.size(), 35u);  // of 35: the others are outside
  EXPECT_LT(error_px(view, images, pose, Eigen::Vector2d::Zero(), false), 0.15);
}

TEST(FindBoard, FindsAChessboardsCornersToAFewHundredthsOfAPixel) {
  const Board board{BoardKind::Chessboard, 9, 6, 0.03, 0.0, ""};
  const auto finder = BoardFinder::make(board);
  ASSERT_TRUE(finder) << finder.error().message;
  BoardImages images(bent(), kWidth_px, kHeight_px, board);
  std::mt19937 random(3);
  for (const double tilt : {0.0, 0.4}) {
    const CameraFromWorld pose = images.pose({300.0, 230.0}, 0.42, tilt, random);

    const BoardView view = finder->find(grey(images.draw(pose, random)));

    ASSERT_EQ(view.seen_px.size(), 40u) << tilt;
    EXPECT_LT(chessboard_error_px(view, images, pose, board), 0.08) << tilt;
  }
}

TEST(FindBoard, FindsNothingInAnEmptyImage) {
  const auto finder = BoardFinder::make({});
  std::vector<std::uint8_t> pixels(kWidth_px * kHeight_px, 90);
  EXPECT_TRUE(finder->find(grey(pixels)).seen_px.empty());
  EXPECT_TRUE(finder->find({}).seen_px.empty());
}

TEST(FindBoard, RefusesImpossibleBoards) {
  const auto message = [](const Board& board) {
    const auto finder = BoardFinder::make(board);
    return finder ? std::string() : finder.error().message;
  };
  EXPECT_THAT(message({BoardKind::Charuco, 8, 6, 0.03, 0.03, "4x4_50"}), testing::HasSubstr("marker is 30 mm"));
  EXPECT_THAT(message({BoardKind::Charuco, 12, 10, 0.03, 0.02, "4x4_50"}),
              testing::HasSubstr("board needs 60 markers"));
  EXPECT_THAT(message({BoardKind::Charuco, 8, 6, 0.03, 0.02, "9x9_1"}), testing::HasSubstr("expected one of 4x4_50"));
  EXPECT_THAT(message({BoardKind::Chessboard, 2, 6, 0.03, 0.0, ""}), testing::HasSubstr("board is 2 x 6 squares"));
}

}  // namespace find_board_test
}  // namespace mocap::calibration
