#include "calibration/lens/find_board.h"

#include <fmt/format.h>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMinCorners = 6;
constexpr int kMaxSquares = 60;
// The sub-pixel search reads a window of pixels: nearer to the image border the window is cut off. Chosen by hand.
constexpr float kBorder_px = 4.0F;
// Corners whose second principal extent is a smaller fraction of the first lie on a line. Chosen by hand.
constexpr double kMinFlatness = 0.05;

struct Dictionary {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME id;
};
constexpr std::array<Dictionary, 17> kDictionaries{{{"4x4_50", cv::aruco::DICT_4X4_50},
                                                    {"4x4_100", cv::aruco::DICT_4X4_100},
                                                    {"4x4_250", cv::aruco::DICT_4X4_250},
                                                    {"4x4_1000", cv::aruco::DICT_4X4_1000},
                                                    {"5x5_50", cv::aruco::DICT_5X5_50},
                                                    {"5x5_100", cv::aruco::DICT_5X5_100},
                                                    {"5x5_250", cv::aruco::DICT_5X5_250},
                                                    {"5x5_1000", cv::aruco::DICT_5X5_1000},
                                                    {"6x6_50", cv::aruco::DICT_6X6_50},
                                                    {"6x6_100", cv::aruco::DICT_6X6_100},
                                                    {"6x6_250", cv::aruco::DICT_6X6_250},
                                                    {"6x6_1000", cv::aruco::DICT_6X6_1000},
                                                    {"7x7_50", cv::aruco::DICT_7X7_50},
                                                    {"7x7_100", cv::aruco::DICT_7X7_100},
                                                    {"7x7_250", cv::aruco::DICT_7X7_250},
                                                    {"7x7_1000", cv::aruco::DICT_7X7_1000},
                                                    {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL}}};

bool are_collinear(const std::vector<Vector2d>& points) {
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& point : points) middle += point / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Vector2d& point : points) spread += (point - middle) * (point - middle).transpose();
  const double trace = spread.trace();
  return spread.determinant() < kMinFlatness * kMinFlatness * 0.25 * trace * trace;
}

Error invalid(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

}  // namespace

struct BoardFinder::Detector {
  Board board;
  cv::Ptr<cv::aruco::CharucoBoard> charuco;

  BoardView find_chessboard(const cv::Mat& image) const {
    const cv::Size inner(board.columns - 1, board.rows - 1);
    std::vector<cv::Point2f> corners;
    BoardView view;
    if (!cv::findChessboardCornersSB(image, inner, corners, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY)) {
      return view;
    }
    for (int i = 0; i < inner.area(); ++i) {
      const cv::Point2f& corner = corners[static_cast<std::size_t>(i)];
      view.seen_px.emplace_back(corner.x, corner.y);
      const int row = i / inner.width;
      view.board_m.emplace_back(board.square_m * (i % inner.width), board.square_m * row);
    }
    return view;
  }

  // Corrects the half pixel by which OpenCV 4.6 displaces ChArUco corners to the right and down, then refines each
  // corner in a window that does not reach the neighbouring ArUco markers.
  void refine(const cv::Mat& image, std::vector<cv::Point2f>& corners) const {
    if (corners.size() < 2) return;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < corners.size(); ++i) nearest = std::min(nearest, cv::norm(corners[i] - corners[i - 1]));
    const double clearance = 0.5 * (1.0 - board.marker_m / board.square_m) * nearest;
    const int half = std::clamp(static_cast<int>(0.8 * clearance), 2, 10);
    for (cv::Point2f& corner : corners) corner -= cv::Point2f(0.5F, 0.5F);
    cv::cornerSubPix(image, corners, {half, half}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-4});
  }

  static bool is_inside(const cv::Mat& image, const cv::Point2f& corner) {
    return corner.x > kBorder_px && corner.y > kBorder_px &&
           corner.x < static_cast<float>(image.cols) - 1.0F - kBorder_px &&
           corner.y < static_cast<float>(image.rows) - 1.0F - kBorder_px;
  }

  BoardView find_charuco(const cv::Mat& image) const {
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<std::vector<cv::Point2f>> rejected;
    std::vector<int> ids;
    BoardView view;
    const auto parameters = cv::aruco::DetectorParameters::create();
    cv::aruco::detectMarkers(image, charuco->dictionary, markers, ids, parameters, rejected);
    if (ids.empty()) return view;
    cv::aruco::refineDetectedMarkers(image, charuco, markers, ids, rejected);
    std::vector<cv::Point2f> corners;
    std::vector<int> corner_ids;
    cv::aruco::interpolateCornersCharuco(markers, ids, image, charuco, corners, corner_ids);
    refine(image, corners);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!is_inside(image, corners[i])) continue;
      const cv::Point3f& place = charuco->chessboardCorners[static_cast<std::size_t>(corner_ids[i])];
      view.seen_px.emplace_back(corners[i].x, corners[i].y);
      view.board_m.emplace_back(place.x, place.y);
    }
    return view;
  }
};

BoardFinder::BoardFinder(std::unique_ptr<Detector> detector) : detector_(std::move(detector)) {}
BoardFinder::BoardFinder(BoardFinder&&) noexcept = default;
BoardFinder& BoardFinder::operator=(BoardFinder&&) noexcept = default;
BoardFinder::~BoardFinder() = default;

Result<BoardFinder> BoardFinder::make(const Board& board) {
  if (board.columns < 4 || board.rows < 4 || board.columns > kMaxSquares || board.rows > kMaxSquares) {
    return invalid(
        fmt::format("board is {} x {} squares, expected 4 to {} each way", board.columns, board.rows, kMaxSquares));
  }
  if (!(board.square_m > 0.0))
    return invalid(fmt::format("square is {} mm, expected more than 0", 1e3 * board.square_m));
  auto detector = std::make_unique<Detector>();
  detector->board = board;
  if (board.kind == BoardKind::Chessboard) return BoardFinder(std::move(detector));
  if (!(board.marker_m > 0.0 && board.marker_m < board.square_m)) {
    return invalid(fmt::format("marker is {} mm, expected more than 0 and less than the square's {} mm",
                               1e3 * board.marker_m, 1e3 * board.square_m));
  }
  for (const Dictionary& each : kDictionaries) {
    if (board.dictionary != each.name) continue;
    try {
      const auto dictionary = cv::aruco::getPredefinedDictionary(each.id);
      const int needed = board.columns * board.rows / 2;
      if (needed > dictionary->bytesList.rows) {
        return invalid(fmt::format("board needs {} markers, dictionary {} has {}", needed, board.dictionary,
                                   dictionary->bytesList.rows));
      }
      detector->charuco = cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.square_m),
                                                          static_cast<float>(board.marker_m), dictionary);
      return BoardFinder(std::move(detector));
    } catch (const cv::Exception& error) {
      return invalid(fmt::format("OpenCV cannot make the board: {}", error.err));
    }
  }
  std::string known;
  for (const Dictionary& each : kDictionaries) known += (known.empty() ? "" : ", ") + std::string(each.name);
  return invalid(fmt::format("dictionary is '{}', expected one of {}", board.dictionary, known));
}

BoardView BoardFinder::find(const GreyImage& image) const {
  if (image.pixels == nullptr || image.width_px < 16 || image.height_px < 16) return {};
  const cv::Mat borrowed(image.height_px, image.width_px, CV_8UC1,
                         const_cast<std::uint8_t*>(image.pixels),  // OpenCV only reads it
                         image.stride_bytes);
  try {
    BoardView view = detector_->board.kind == BoardKind::Chessboard ? detector_->find_chessboard(borrowed)
                                                                    : detector_->find_charuco(borrowed);
    if (view.seen_px.size() < kMinCorners || are_collinear(view.board_m)) return {};
    return view;
  } catch (const cv::Exception&) {
    return {};  // OpenCV throws on some images without a board
  }
}

}  // namespace mocap::calibration
