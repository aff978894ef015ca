#include "detect/mask_learner.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

using Pixel = MaskLearner::Pixel;
using Pixels = MaskLearner::Pixels;

// Smallest region that counts as a moving marker: a smaller region is noise that exceeded the threshold once. A fast
// marker is bright in each pixel for one image only, but in many pixels.
constexpr std::size_t kMinRegion = 3;
// A region whose convex hull exceeds this multiple of its area is concave (the frame of a window) and is covered in
// pieces of at least kMinPiece pixels.
constexpr double kMaxHullAreaRatio = 1.5;
constexpr std::size_t kMinPiece = 32;
// The margin around a corner is a circumscribed polygon of eight sides, so that the polygon contains the whole circle.
constexpr int kCornerSides = 8;
// A static light is bright with the same frequency everywhere except at its rim, which is a pixel or two wide. The rim
// of a marker on a standing person is as wide as the person sways.
constexpr double kCoreShare = 0.8;     // core: pixels with at least this share of the largest number of bright images
constexpr double kMaxSwayShare = 0.5;  // largest width of the rim of a static light, as a share of the margin

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

// Andrew's monotone chain, "Another efficient algorithm for convex hulls in two dimensions", Information Processing
// Letters 9 (1979).
std::vector<Eigen::Vector2d> hull_of(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Eigen::Vector2d> hull;
  for (const bool upper : {false, true}) {
    const std::size_t base = hull.size();
    for (const Eigen::Vector2d& point : points) {
      while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), point) <= 0.0) hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();  // the last point is also the first point of the other chain
    if (!upper) std::reverse(points.begin(), points.end());
  }
  return hull;
}

double area_of(std::span<const Eigen::Vector2d> polygon) {
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) twice += cross(polygon[0], polygon[i], polygon[i + 1]);
  return 0.5 * std::abs(twice);
}

// The corners of all pixels; a pixel is a unit square.
std::vector<Eigen::Vector2d> corners_of(const Pixels& pixels) {
  std::vector<Eigen::Vector2d> corners;
  for (const Pixel& each : pixels) {
    for (const double dy : {-0.5, 0.5}) {
      for (const double dx : {-0.5, 0.5}) corners.emplace_back(each.x + dx, each.y + dy);
    }
  }
  return corners;
}

// A convex polygon with a margin around it, corners rounded to a tenth of a pixel.
MaskPolygon grown(std::span<const Eigen::Vector2d> hull, double margin_px) {
  const double radius_px = margin_px / std::cos(M_PI / kCornerSides);
  std::vector<Eigen::Vector2d> around;
  for (const Eigen::Vector2d& corner : hull) {
    for (int side = 0; side < kCornerSides; ++side) {
      const double angle_rad = (side + 0.5) * 2.0 * M_PI / kCornerSides;
      around.push_back(corner + radius_px * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
    }
  }
  MaskPolygon polygon;
  for (const Eigen::Vector2d& corner : hull_of(around)) polygon.push_back({(corner * 10.0).array().round() / 10.0});
  return polygon;
}

// Appends convex polygons that cover the pixels: one polygon, or those of both halves along the longer side if the
// region is concave.
void cover(Pixels pixels, double margin_px, std::vector<MaskPolygon>& into) {
  const std::vector<Eigen::Vector2d> hull = hull_of(corners_of(pixels));
  const auto count = static_cast<double>(pixels.size());
  if (pixels.size() < 2 * kMinPiece || area_of(hull) <= kMaxHullAreaRatio * count) {
    into.push_back(grown(hull, margin_px));
    return;
  }
  const auto [left, right] = std::ranges::minmax(pixels, {}, &Pixel::x);
  const auto [top, bottom] = std::ranges::minmax(pixels, {}, &Pixel::y);
  const bool wide = right.x - left.x > bottom.y - top.y;
  const int middle = wide ? (left.x + right.x) / 2 : (top.y + bottom.y) / 2;
  const auto second = std::partition(pixels.begin(), pixels.end(),
                                     [&](const Pixel& each) { return (wide ? each.x : each.y) <= middle; });
  Pixels rest(second, pixels.end());
  pixels.erase(second, pixels.end());
  cover(std::move(pixels), margin_px, into);
  cover(std::move(rest), margin_px, into);
}

// Returns the 8-connected region of non-zero pixels around `from`, and sets its pixels in `counts` to 0.
Pixels take_region(Pixel from, std::vector<std::uint32_t>& counts, int width_px, int height_px) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
  };
  Pixels region{from};
  counts[index(from.x, from.y)] = 0;
  for (std::size_t i = 0; i < region.size(); ++i) {
    const Pixel at = region[i];
    for (int y = std::max(at.y - 1, 0); y <= std::min(at.y + 1, height_px - 1); ++y) {
      for (int x = std::max(at.x - 1, 0); x <= std::min(at.x + 1, width_px - 1); ++x) {
        if (std::exchange(counts[index(x, y)], 0U) != 0) region.push_back({x, y});
      }
    }
  }
  return region;
}

}  // namespace

MaskLearner::Pixels MaskLearner::pixels_above(const Pixels& region, std::uint32_t least) const {
  Pixels found;
  std::ranges::copy_if(region, std::back_inserter(found), [&](const Pixel& each) { return count_at(each) >= least; });
  return found;
}

bool MaskLearner::is_static(const Pixels& region, std::uint32_t most, double margin_px) const {
  std::vector<MaskPolygon> covers;
  const auto least = static_cast<std::uint32_t>(std::ceil(kCoreShare * most));
  cover(pixels_above(region, least), kMaxSwayShare * margin_px, covers);
  const RowMask covered(covers, width_px_, height_px_);
  return std::ranges::all_of(region, [&](const Pixel& each) { return covered.masks(each.x, each.y); });
}

MaskLearner::MaskLearner(int width_px, int height_px, std::span<const MaskPolygon> masked)
    : width_px_(width_px),
      height_px_(height_px),
      masked_(masked.begin(), masked.end()),
      known_(masked, width_px, height_px),
      bright_count_(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)),
      row_(static_cast<std::size_t>(width_px)) {}

bool MaskLearner::add(const Image& image, double threshold_grey) {
  const std::uint32_t top = top_of(image.format);
  if (image.width_px != width_px_ || image.height_px != height_px_ || top == 0 || !is_whole(image)) return false;
  // The threshold is rounded as in the detector.
  const double threshold = std::ceil(threshold_grey * top / 255.0 - 1e-9);
  for (int y = 0; y < height_px_; ++y) {
    read_pixels(image, y, 0, row_);
    for (int x = 0; x < width_px_; ++x) {
      const auto column = static_cast<std::size_t>(x);
      if (row_[column] < threshold || known_.masks(x, y)) continue;
      ++bright_count_[static_cast<std::size_t>(y) * row_.size() + column];
    }
  }
  ++images_;
  return true;
}

LearntMask MaskLearner::learn(const LearnMaskSettings& settings) const {
  LearntMask learnt;
  const auto least =
      static_cast<std::uint32_t>(std::max(1.0, std::ceil(settings.least_share * static_cast<double>(images_))));
  std::vector<std::uint32_t> left = bright_count_;
  for (int y = 0; y < height_px_; ++y) {
    for (int x = 0; x < width_px_; ++x) {
      if (left[static_cast<std::size_t>(y) * row_.size() + static_cast<std::size_t>(x)] == 0) continue;
      const Pixels region = take_region({x, y}, left, width_px_, height_px_);
      std::uint32_t most = 0;
      for (const Pixel& each : region) most = std::max(most, count_at(each));
      if (most >= least && is_static(region, most, settings.margin_px)) {
        ++learnt.lights;
        cover(pixels_above(region, least), settings.margin_px, learnt.polygons);
      } else if (region.size() >= kMinRegion) {
        ++learnt.moved;
      }
    }
  }
  std::vector<MaskPolygon> all = masked_;
  all.insert(all.end(), learnt.polygons.begin(), learnt.polygons.end());
  const double pixels = static_cast<double>(width_px_) * static_cast<double>(height_px_);
  learnt.covered_share = static_cast<double>(RowMask(all, width_px_, height_px_).count()) / pixels;
  return learnt;
}

}  // namespace mocap::detect
