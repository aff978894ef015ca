#include "calibration/wand/wand_progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// As WandSettings::min_samples: with fewer shared samples solve_wand estimates no relative pose.
constexpr std::size_t kMinSharedSamples = 60;

}  // namespace

WandProgress::WandProgress(Rig rig, Wand wand, const WandProgressSettings& settings)
    : rig_(std::move(rig)),
      wand_(std::move(wand)),
      settings_(settings),
      tolerance_(wand_tolerance(settings.lens_known)),
      cameras_(rig_.size()),
      shared_samples_(rig_.size() * rig_.size(), 0) {}

void WandProgress::add(std::size_t camera, const Picture& image) {
  Camera& own = cameras_[camera];
  const CameraModel& model = rig_[camera];
  ++own.images;
  undistorted_px_.clear();
  index_.clear();
  for (std::size_t i = 0; i < image.spots.size(); ++i) {
    const auto ray = geometry::undistort(model.lens, image.spots[i].at);
    if (!ray) continue;
    undistorted_px_.push_back(ray->v * model.lens.fx_px);
    index_.push_back(i);
  }
  const WandDetection detection = detect_wand(undistorted_px_, wand_, tolerance_);
  if (!detection.found) return;
  for (std::size_t m = 0; m < wand_.marks_m.size(); ++m) {
    const Eigen::Vector2d& at = image.spots[index_[static_cast<std::size_t>(detection.blobs[m])]].at.v;
    const int x = std::clamp(static_cast<int>(kImageCells * at.x() / model.width_px), 0, kImageCells - 1);
    const int y = std::clamp(static_cast<int>(kImageCells * at.y() / model.height_px), 0, kImageCells - 1);
    ++own.cells[static_cast<std::size_t>(y * kImageCells + x)];
  }
  own.samples.emplace_back(image.exposed_at, false);
  for (std::size_t other = 0; other < cameras_.size(); ++other) {
    if (other == camera) continue;
    auto& theirs = cameras_[other].samples;
    const auto from =
        std::ranges::lower_bound(theirs, image.exposed_at - settings_.max_skew, {}, &std::pair<Timestamp, bool>::first);
    if (from == theirs.end() || from->first > image.exposed_at + settings_.max_skew) continue;
    ++shared_samples_[camera * cameras_.size() + other];
    ++shared_samples_[other * cameras_.size() + camera];
    for (auto [sample, of] : {std::pair{&own.samples.back(), &own}, std::pair{&*from, &cameras_[other]}}) {
      of->shared += sample->second ? 0 : 1;
      sample->second = true;
    }
  }
}

// Graph search from the first camera.
std::vector<bool> WandProgress::connected_cameras() const {
  const std::size_t n = cameras_.size();
  std::vector<bool> connected(n, false);
  if (n == 0) return connected;
  std::vector<std::size_t> open{0};
  connected[0] = true;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    for (std::size_t to = 0; to < n; ++to) {
      if (connected[to] || shared_samples_[at * n + to] < kMinSharedSamples) continue;
      connected[to] = true;
      open.push_back(to);
    }
  }
  return connected;
}

CameraProgress WandProgress::progress_of(std::size_t camera) const {
  const Camera& own = cameras_[camera];
  const auto occupied = std::ranges::count_if(own.cells, [](std::uint32_t count) { return count > 0; });
  CameraProgress progress;
  progress.images = own.images;
  progress.samples = own.samples.size();
  progress.shared = own.shared;
  progress.coverage = static_cast<double>(occupied) / (kImageCells * kImageCells);
  progress.cells = own.cells;
  progress.least_covered = least_covered_region(own.cells, kImageCells);
  progress.is_connected = connected_cameras()[camera];
  return progress;
}

bool WandProgress::is_complete(const CameraProgress& camera) const {
  return camera.is_connected && camera.shared >= settings_.min_samples &&
         (camera.coverage >= settings_.min_coverage || camera.shared >= settings_.samples_without_coverage);
}

bool WandProgress::is_complete() const {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!is_complete(progress_of(c))) return false;
  }
  return !cameras_.empty();
}

std::string WandProgress::advice() const {
  std::size_t worst = cameras_.size();
  double least = 1e9;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraProgress progress = progress_of(c);
    if (is_complete(progress)) continue;
    const double done =
        static_cast<double>(progress.shared) + 100.0 * progress.coverage + (progress.is_connected ? 1000.0 : 0.0);
    if (done >= least) continue;
    least = done;
    worst = c;
  }
  if (worst == cameras_.size()) return {};
  const CameraProgress progress = progress_of(worst);
  const std::string& name = rig_[worst].name;
  if (progress.samples == 0) return fmt::format("camera {} has not seen the wand yet", name);
  if (progress.shared < settings_.min_samples || !progress.is_connected)
    return fmt::format("wave in the common view of {} and another camera: {} of {} samples", name, progress.shared,
                       settings_.min_samples);
  return fmt::format("wave in {} of the image of {}: {:.0f} % covered",
                     progress.least_covered.empty() ? "more" : progress.least_covered, name, 100.0 * progress.coverage);
}

}  // namespace mocap::calibration
