#include "calibration/wand/wand_detections.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/robust_statistics.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

// The wand is refused as still if its markers move by less than this, beyond the wand's own length, in every camera.
// Chosen by hand; not yet measured.
constexpr double kMinMotion_px = 15.0;
// A second wand in more than this fraction of a camera's images is no chance arrangement of clutter. Chosen by hand;
// not yet measured.
constexpr double kMaxSecondWandFraction = 0.2;
// Blobs so far outside the image still count as inside: centroids of blobs at the border.
constexpr double kBorderTolerance_px = 2.0;

struct DetectionCounts {
  std::size_t images = 0;
  std::size_t found = 0;
  std::size_t two_wands = 0;
  std::size_t outside = 0;  // blobs outside the image
  std::size_t blobs = 0;
  std::vector<double> ratios;  // division ratio of any three collinear blobs, the smaller part over the whole
  Vector2d least = Vector2d::Constant(1e9);
  Vector2d most = Vector2d::Constant(-1e9);
};

/// Detects the wand in the images of one camera.
class WandDetector {
 public:
  WandDetector(const CameraModel& camera, const Wand& wand, const WandSettings& settings)
      : camera_(camera), wand_(wand), tolerance_(wand_tolerance(settings.lens_known)) {
    any_wand_.marks_m = {0.0, 0.5, 1.0};
    any_tolerance_ = tolerance_;
    any_tolerance_.ratio_tolerance = 0.4;
  }

  std::optional<WandView> detect(const Picture& image, DetectionCounts& counts) {
    undistorted_px_.clear();
    rays_.clear();
    index_.clear();
    ++counts.images;
    for (std::size_t i = 0; i < image.spots.size(); ++i) {
      const Vector2d& at = image.spots[i].at.v;
      ++counts.blobs;
      const bool inside = at.x() > -kBorderTolerance_px && at.y() > -kBorderTolerance_px &&
                          at.x() < camera_.width_px + kBorderTolerance_px &&
                          at.y() < camera_.height_px + kBorderTolerance_px;
      counts.outside += inside ? 0 : 1;
      const auto ray = geometry::undistort(camera_.lens, {at});
      if (!ray) continue;
      rays_.push_back(ray->v);
      undistorted_px_.push_back(ray->v * camera_.lens.fx_px);
      index_.push_back(static_cast<int>(i));
    }
    const WandDetection detection = detect_wand(undistorted_px_, wand_, tolerance_);
    if (detection.two_wands) ++counts.two_wands;
    if (wand_.marks_m.size() == 3 && undistorted_px_.size() == 3) record_ratio(counts);
    if (!detection.found) return std::nullopt;
    ++counts.found;
    return view_of(detection.blobs, counts);
  }

 private:
  // Records the ratio of a wand with its middle marker anywhere, to distinguish a wrong wand from a missing wand.
  void record_ratio(DetectionCounts& counts) const {
    const WandDetection any = detect_wand(undistorted_px_, any_wand_, any_tolerance_);
    if (any.blobs[0] < 0) return;
    const auto at = [&](int marker) {
      return undistorted_px_[static_cast<std::size_t>(any.blobs[static_cast<std::size_t>(marker)])];
    };
    const double ratio = (at(1) - at(0)).norm() / (at(2) - at(0)).norm();
    counts.ratios.push_back(std::min(ratio, 1.0 - ratio));
  }

  WandView view_of(const WandBlobs& blobs, DetectionCounts& counts) const {
    WandView view;
    view.rays.ends_unknown = wand_.is_symmetric();
    for (std::size_t m = 0; m < wand_.marks_m.size(); ++m) {
      const auto blob = static_cast<std::size_t>(blobs[m]);
      view.blobs[m] = index_[blob];
      view.rays.ray[m] = rays_[blob];
      counts.least = counts.least.cwiseMin(undistorted_px_[blob]);
      counts.most = counts.most.cwiseMax(undistorted_px_[blob]);
    }
    return view;
  }

  const CameraModel& camera_;
  const Wand& wand_;
  WandTolerance tolerance_;
  Wand any_wand_;
  WandTolerance any_tolerance_;
  std::vector<Vector2d> undistorted_px_;
  std::vector<Vector2d> rays_;
  std::vector<int> index_;
};

std::optional<WandError> check_counts(const CameraModel& camera, const DetectionCounts& counts, const Wand& wand) {
  if (counts.blobs > 50 && 20 * counts.outside > counts.blobs) {
    return WandError{
        WandFault::WrongImageSize,
        fmt::format("camera '{}': {} of {} blobs lie outside the image of {}x{} px for which its lens file was made; "
                    "use a lens file for the captured image size",
                    camera.name, counts.outside, counts.blobs, camera.width_px, camera.height_px)};
  }
  if (static_cast<double>(counts.two_wands) > kMaxSecondWandFraction * static_cast<double>(counts.images) &&
      counts.two_wands > counts.found / 2) {
    return WandError{WandFault::TwoWands,
                     fmt::format("camera '{}': two wands in {} of {} images; remove one of them, or cover the object "
                                 "that looks like a wand",
                                 camera.name, counts.two_wands, counts.images)};
  }
  if (wand.marks_m.size() == 3 && counts.ratios.size() > 20 && 4 * counts.found < counts.ratios.size()) {
    const double expected = wand.marks_m[1] / wand.length_m();
    return WandError{
        WandFault::WrongWand,
        fmt::format("camera '{}': {} images show three collinear markers whose middle one divides the line at {:.2f}, "
                    "expected {:.2f} for the wand ({:.0f}, {:.0f}, {:.0f} mm); set the marker positions of your wand "
                    "with --wand",
                    camera.name, counts.ratios.size(), median(counts.ratios), std::min(expected, 1.0 - expected),
                    1e3 * wand.marks_m[0], 1e3 * wand.marks_m[1], 1e3 * wand.marks_m[2])};
  }
  if (counts.found == 0) {
    return WandError{WandFault::NoWand,
                     fmt::format("camera '{}': no wand in any of {} images ({} blobs); wave the wand in the view of "
                                 "this camera, check exposure and threshold",
                                 camera.name, counts.images, counts.blobs)};
  }
  return std::nullopt;
}

}  // namespace

const Picture* WandDetections::image(std::size_t camera, std::size_t instant) const {
  const int index = instants[instant].image[camera];
  return index < 0 ? nullptr : &recording->cameras[camera][static_cast<std::size_t>(index)];
}

Result<WandDetections, WandError> detect_wands(const Take& recording, const Rig& rig, const Wand& wand,
                                               const WandSettings& settings) {
  WandDetections detections;
  detections.recording = &recording;
  detections.instants = group_by_instant(recording, settings.max_skew);
  detections.views.resize(rig.size());
  bool moved = false;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    WandDetector detector(rig[c], wand, settings);
    DetectionCounts counts;
    detections.views[c].resize(detections.instants.size());
    for (std::size_t i = 0; i < detections.instants.size(); ++i) {
      if (const Picture* image = detections.image(c, i)) detections.views[c][i] = detector.detect(*image, counts);
    }
    if (auto error = check_counts(rig[c], counts, wand)) return *std::move(error);
    double length = 0.0;
    for (const auto& view : detections.views[c]) {
      if (!view) continue;
      length = (view->rays.ray[0] - view->rays.ray[wand.marks_m.size() - 1]).norm() * rig[c].lens.fx_px;
      break;
    }
    moved = moved || (counts.most - counts.least).norm() > length + kMinMotion_px;
  }
  if (!moved) {
    return WandError{WandFault::StillWand,
                     fmt::format("the wand does not move: less than {:.0f} px in every camera; wave it through the "
                                 "whole volume",
                                 kMinMotion_px)};
  }
  return detections;
}

}  // namespace mocap::calibration
