#include "calibrate/lens_views.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "base/list_folder.h"

namespace mocap::calibrate {
namespace {

using Eigen::Vector2d;

// A view is new if an outer corner of the board moved by this fraction of the image diagonal. Chosen by hand; not yet
// measured.
constexpr double kNewViewDistance = 0.04;
constexpr int kSaturation = 200;  // corners in a cell that give the darkest character

GreyPixels of_mat(const cv::Mat& mat) {
  GreyPixels grey;
  grey.width_px = mat.cols;
  grey.height_px = mat.rows;
  for (int row = 0; row < mat.rows; ++row) grey.bytes.insert(grey.bytes.end(), mat.ptr(row), mat.ptr(row) + mat.cols);
  return grey;
}

// `step`: bytes per pixel. 16-bit pixels with `bits` used bits are scaled to 8.
GreyPixels of_rows(const Image& image, std::size_t step, int bits) {
  GreyPixels grey;
  grey.width_px = image.width_px;
  grey.height_px = image.height_px;
  const auto width = static_cast<std::size_t>(image.width_px);
  const auto height = static_cast<std::size_t>(image.height_px);
  grey.bytes.reserve(width * height);
  for (std::size_t row = 0; row < height; ++row) {
    const std::byte* at = image.bytes.data() + row * image.stride_bytes;
    for (std::size_t i = 0; i < width; ++i, at += step) {
      unsigned value = std::to_integer<unsigned>(at[0]);
      if (bits > 8) value = (value | std::to_integer<unsigned>(at[1]) << 8u) >> static_cast<unsigned>(bits - 8);
      grey.bytes.push_back(static_cast<std::uint8_t>(std::min(value, 255u)));
    }
  }
  return grey;
}

bool is_image_file(const std::filesystem::path& file) {
  static const std::set<std::string> endings{".png", ".pgm", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"};
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return endings.contains(ending);
}

// Maps the bounding box of the board's corners into the image with the best affine map.
std::array<Vector2d, 4> outline_of(const calibration::BoardView& view) {
  const auto count = static_cast<Eigen::Index>(view.seen_px.size());
  Eigen::MatrixX3d board(count, 3);
  Eigen::MatrixX2d seen(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    board.row(i) << view.board_m[static_cast<std::size_t>(i)].transpose(), 1.0;
    seen.row(i) = view.seen_px[static_cast<std::size_t>(i)].transpose();
  }
  const Eigen::Matrix<double, 3, 2> map = board.colPivHouseholderQr().solve(seen);
  const Eigen::RowVector2d low = board.leftCols<2>().colwise().minCoeff();
  const Eigen::RowVector2d high = board.leftCols<2>().colwise().maxCoeff();
  std::array<Vector2d, 4> outline;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::RowVector3d corner(i % 2 == 0 ? low.x() : high.x(), i / 2 == 0 ? low.y() : high.y(), 1.0);
    outline[i] = (corner * map).transpose();
  }
  return outline;
}

}  // namespace

Result<GreyPixels> grey_of(const Image& image) {
  switch (image.format) {
    case PixelFormat::Mono8:
    case PixelFormat::Nv12: return of_rows(image, 1, 8);
    case PixelFormat::Mono10: return of_rows(image, 2, 10);
    case PixelFormat::Mono12: return of_rows(image, 2, 12);
    case PixelFormat::Yuyv: return of_rows(image, 2, 8);
    case PixelFormat::Mjpeg: break;
    default:
      return Error{ErrorCode::Unsupported,
                   "boards cannot be detected in packed or raw colour images; set the pixel format of the camera to "
                   "Mono8 for the calibration of lenses"};
  }
  try {
    const cv::Mat bytes(1, static_cast<int>(image.bytes.size()), CV_8UC1,
                        const_cast<std::byte*>(image.bytes.data()));  // OpenCV only reads it
    const cv::Mat grey = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
    if (!grey.empty()) return of_mat(grey);
  } catch (const cv::Exception&) {  // falls through to the error
  }
  return Error{ErrorCode::Io, "an image is not a readable JPEG"};
}

Result<GreyPixels> read_grey(const std::filesystem::path& file) {
  try {
    const cv::Mat grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (!grey.empty()) return of_mat(grey);
  } catch (const cv::Exception&) {  // falls through to the error
  }
  return Error{ErrorCode::Io, fmt::format("{} is not a readable image", file.string())};
}

Result<std::vector<std::filesystem::path>> images_of(const std::filesystem::path& folder, const std::string& camera) {
  std::error_code failed;
  const auto own = folder / camera;
  const auto& place = !camera.empty() && std::filesystem::is_directory(own, failed) ? own : folder;
  std::vector<std::filesystem::path> files;
  for (const auto& file : list_folder(place).paths) {
    if (std::filesystem::is_regular_file(file, failed) && is_image_file(file)) files.push_back(file);
  }
  if (files.empty()) {
    return Error{
        ErrorCode::NotFound,
        fmt::format("camera '{}': no images in {}, expected .png, .pgm, .jpg, .bmp or .tif", camera, place.string())};
  }
  return files;
}

Status LensViews::add(const GreyPixels& image) {
  if (images_ == 0) {
    width_px_ = image.width_px;
    height_px_ = image.height_px;
  }
  if (image.width_px != width_px_ || image.height_px != height_px_) {
    return Error{ErrorCode::InvalidArgument, fmt::format("an image is {}x{}, the images before are {}x{}",
                                                         image.width_px, image.height_px, width_px_, height_px_)};
  }
  ++images_;
  if (full()) return {};
  calibration::BoardView view = finder_.find(image.view());
  if (view.seen_px.empty()) return {};
  ++found_;
  const Outline outline = outline_of(view);
  if (!is_new(outline)) return {};
  views_.push_back(std::move(view));
  outlines_.push_back(outline);
  return {};
}

bool LensViews::is_new(const Outline& outline) const {
  const double least = kNewViewDistance * std::hypot(width_px_, height_px_);
  return std::ranges::all_of(outlines_, [&](const Outline& before) {
    double most = 0.0;
    for (std::size_t i = 0; i < outline.size(); ++i) most = std::max(most, (outline[i] - before[i]).norm());
    return most > least;
  });
}

std::string coverage_map(const calibration::LensCoverage& coverage, const std::string& indent) {
  constexpr std::string_view kShades = ".:-=+*#%@";
  std::string text;
  for (std::size_t i = 0; i < coverage.corners.size(); ++i) {
    if (i % calibration::kImageCells == 0) text += indent;
    const double dark = std::log1p(std::min(coverage.corners[i], kSaturation)) / std::log1p(kSaturation);
    const auto shade = static_cast<std::size_t>(std::ceil(dark * static_cast<double>(kShades.size() - 1)));
    text += std::string(2, kShades[shade]);
    if (i % calibration::kImageCells == calibration::kImageCells - 1) text += '\n';
  }
  return text;
}

}  // namespace mocap::calibrate
