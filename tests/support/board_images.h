#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <vector>

#include "calibration/lens/find_board.h"
#include "geometry/lens.h"
#include "model/camera_model.h"

namespace mocap::support {

/// Renders images of calibration boards through a lens model, and computes the true positions of their corners.
class BoardImages {
 public:
  BoardImages(const Lens& lens, int width_px, int height_px, const calibration::Board& board)
      : lens_(lens), width_px_(width_px), height_px_(height_px), board_(board) {
    if (board.kind == calibration::BoardKind::Charuco) {
      const auto charuco = cv::aruco::CharucoBoard::create(
          board.columns, board.rows, static_cast<float>(board.square_m), static_cast<float>(board.marker_m),
          cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
      charuco->draw({kSquare_px * board.columns, kSquare_px * board.rows}, pattern_, 0, 1);
    }
  }

  /// Returns a random pose of the board: its centre is seen at `px`, `distance_m` from the camera, and the board is
  /// tilted by `tilt_rad` about a random axis. Board frame: x right, y down, as for OpenCV 4.6 ChArUco boards.
  CameraFromWorld pose(const Eigen::Vector2d& px, double distance_m, double tilt_rad, std::mt19937& random) const {
    std::uniform_real_distribution<double> turn(0.0, 6.283185307179586);
    const double side = turn(random);
    const Eigen::Vector3d axis(std::cos(side), std::sin(side), 0.0);
    CameraFromWorld pose;
    pose.rotation = Eigen::AngleAxisd(tilt_rad, axis).toRotationMatrix() *
                    Eigen::AngleAxisd(0.3 * std::sin(turn(random)), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const auto ray = geometry::undistort(lens_, {px});
    const Eigen::Vector3d place = Eigen::Vector3d(ray->v.x(), ray->v.y(), 1.0).normalized() * distance_m;
    pose.translation = place - pose.rotation * middle();
    return pose;
  }

  /// Renders an image; Gaussian noise with a standard deviation of 2 grey levels.
  std::vector<std::uint8_t> draw(const CameraFromWorld& pose, std::mt19937& random) {
    if (rays_.empty()) cast_rays();
    std::normal_distribution<double> noise(0.0, 2.0);
    std::vector<std::uint8_t> pixels;
    for (int row = 0; row < height_px_; ++row) {
      for (int column = 0; column < width_px_; ++column) {
        const double grey = 40.0 + 170.0 * pixel(pose, row, column) + noise(random);
        pixels.push_back(static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0)));
      }
    }
    return pixels;
  }

  /// Projects a point of the board; returns nothing if it is outside the image.
  std::optional<Eigen::Vector2d> seen(const CameraFromWorld& pose, const Eigen::Vector2d& board_m) const {
    const Eigen::Vector3d at = pose.rotation * Eigen::Vector3d(board_m.x(), board_m.y(), 0.0) + pose.translation;
    if (at.z() < 0.01) return std::nullopt;
    const PixelPoint px = geometry::distort(lens_, {at.head<2>() / at.z()});
    const bool inside = px.v.x() > 1.0 && px.v.y() > 1.0 && px.v.x() < width_px_ - 2.0 && px.v.y() < height_px_ - 2.0;
    // The distortion polynomial can map points far outside the image back into it; reject those.
    const auto back = geometry::undistort(lens_, px);
    if (!inside || !back || (back->v - at.head<2>() / at.z()).norm() > 1e-6) return std::nullopt;
    return px.v;
  }

  /// Returns all visible inner corners as a corner detector would, with Gaussian noise of `noise_px`.
  calibration::BoardView view(const CameraFromWorld& pose, double noise_px, std::mt19937& random) const {
    std::normal_distribution<double> noise(0.0, noise_px);
    calibration::BoardView view;
    for (int row = 1; row < board_.rows; ++row) {
      for (int column = 1; column < board_.columns; ++column) {
        const Eigen::Vector2d corner(board_.square_m * column, board_.square_m * row);
        const auto px = seen(pose, corner);
        if (!px) continue;
        view.board_m.push_back(corner);
        view.seen_px.emplace_back(*px + Eigen::Vector2d(noise(random), noise(random)));
      }
    }
    return view;
  }

 private:
  static constexpr int kSquare_px = 120;
  static constexpr int kSamples = 4;  // samples of a pixel along each axis

  // Computes the rays of all pixel corners. Within a pixel, rays are interpolated linearly.
  void cast_rays() {
    rays_.resize(static_cast<std::size_t>((width_px_ + 1) * (height_px_ + 1)));
    for (int row = 0; row <= height_px_; ++row) {
      for (int column = 0; column <= width_px_; ++column) {
        const auto ray = geometry::undistort(lens_, {{column - 0.5, row - 0.5}});
        if (ray) rays_[index(row, column)] = ray->v;
      }
    }
  }

  std::size_t index(int row, int column) const { return static_cast<std::size_t>(row * (width_px_ + 1) + column); }
  Eigen::Vector3d middle() const {
    return {0.5 * board_.columns * board_.square_m, 0.5 * board_.rows * board_.square_m, 0.0};
  }

  double pixel(const CameraFromWorld& pose, int row, int column) const {
    double sum = 0.0;
    for (int i = 0; i < kSamples; ++i) {
      for (int k = 0; k < kSamples; ++k) {
        const double v = (i + 0.5) / kSamples;
        const double u = (k + 0.5) / kSamples;
        const auto top = corner(row, column, u);
        const auto bottom = corner(row + 1, column, u);
        if (!top || !bottom) continue;
        const Eigen::Vector2d ray = (1.0 - v) * *top + v * *bottom;
        sum += bright(pose, ray);
      }
    }
    return sum / (kSamples * kSamples);
  }

  std::optional<Eigen::Vector2d> corner(int row, int column, double u) const {
    const auto& left = rays_[index(row, column)];
    const auto& right = rays_[index(row, column + 1)];
    if (!left || !right) return std::nullopt;
    return Eigen::Vector2d((1.0 - u) * *left + u * *right);
  }

  // Brightness, 0 to 1, of the point that the ray hits; 0.5 beside the board.
  double bright(const CameraFromWorld& pose, const Eigen::Vector2d& ray) const {
    const Eigen::Vector3d direction(ray.x(), ray.y(), 1.0);
    const Eigen::Vector3d normal = pose.rotation.col(2);
    const double distance = normal.dot(pose.translation) / normal.dot(direction);
    if (!(distance > 0.0)) return 0.5;
    const Eigen::Vector3d on = pose.rotation.transpose() * (distance * direction - pose.translation);
    const double x = on.x() / board_.square_m;
    const double y = on.y() / board_.square_m;
    const bool on_board = x >= 0.0 && y >= 0.0 && x < board_.columns && y < board_.rows;
    const bool on_rim = x >= -1.0 && y >= -1.0 && x < board_.columns + 1 && y < board_.rows + 1;
    if (!on_board) return on_rim ? 1.0 : 0.5;
    if (pattern_.empty()) return (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0 ? 0.0 : 1.0;
    const int row = std::clamp(static_cast<int>(y * kSquare_px), 0, pattern_.rows - 1);
    const int column = std::clamp(static_cast<int>(x * kSquare_px), 0, pattern_.cols - 1);
    return pattern_.at<std::uint8_t>(row, column) > 127 ? 1.0 : 0.0;
  }

  Lens lens_;
  int width_px_;
  int height_px_;
  calibration::Board board_;
  cv::Mat pattern_;
  std::vector<std::optional<Eigen::Vector2d>> rays_;
};

}  // namespace mocap::support
