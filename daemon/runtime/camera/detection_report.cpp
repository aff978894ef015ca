#include "runtime/camera/detection_report.h"

#include <fmt/format.h>

#include <cmath>

namespace mocap::runtime {
namespace {

// Smaller changes of the threshold follow the image noise and are not logged.
constexpr double kMuch = 0.25;  // fraction of the threshold logged last
constexpr double kMuch_grey = 4.0;
constexpr Duration kThresholdAgain = std::chrono::seconds(10);
// Shorter periods without blobs are normal: a subject leaves the volume or hides a marker.
constexpr Duration kBlindFor = std::chrono::seconds(3);
constexpr Duration kLossesAgain = std::chrono::minutes(1);

}  // namespace

DetectionSeen detection_seen(const Pipeline& pipeline, CameraId camera) {
  const CameraCounters& counters = pipeline.camera_counters(camera);
  return {counters.frames.read(), counters.detection.counts(), counters.detection.levels()};
}

std::vector<DetectionReport::Line> DetectionReport::look(const DetectionSeen& seen, Timestamp now) {
  std::vector<Line> lines;
  if (seen.levels.threshold_grey > 0.0) {
    if (auto line = threshold_line(seen.levels, now)) lines.push_back({LogLevel::Info, *std::move(line)});
  }
  if (auto line = losses_line(seen, now)) lines.push_back(*std::move(line));
  before_ = seen;
  return lines;
}

std::optional<std::string> DetectionReport::threshold_line(const DetectionLevels& levels, Timestamp now) {
  if (logged_threshold_grey_) {
    const double change_grey = std::abs(levels.threshold_grey - *logged_threshold_grey_);
    if (change_grey < std::max(kMuch_grey, kMuch * *logged_threshold_grey_)) return std::nullopt;
    if (now - logged_threshold_at_ < kThresholdAgain) return std::nullopt;
  }
  const std::string was = logged_threshold_grey_ ? fmt::format(", was {:.0f}", *logged_threshold_grey_) : "";
  logged_threshold_grey_ = levels.threshold_grey;
  logged_threshold_at_ = now;
  return fmt::format("threshold {:.0f} grey (noise {:.1f}, background {:.0f}), {}{}", levels.threshold_grey,
                     levels.noise_grey, levels.background_grey, automatic_ ? "automatic" : "as set", was);
}

std::optional<DetectionReport::Line> DetectionReport::losses_line(const DetectionSeen& seen, Timestamp now) {
  const std::uint64_t images = seen.images - before_.images;
  const DetectionCounts counts = seen.counts.since(before_.counts);
  if (images == 0) return std::nullopt;
  const bool again = !logged_losses_at_ || now - *logged_losses_at_ >= kLossesAgain;

  if (counts.blobs > 0) {
    blind_since_.reset();
    // If a bound is reached, blobs are lost although others are found.
    const bool over_a_bound = counts.dropped > 0 || counts.rows_given_up > 0;
    if (!over_a_bound || !again) return std::nullopt;
    logged_losses_at_ = now;
    return Line{LogLevel::Warn, fmt::format("{} blobs in {} images, and left out: {}; mask what shines, or raise its "
                                            "threshold",
                                            counts.blobs, images, words_of_losses(counts))};
  }
  if (!blind_since_) blind_since_ = now;
  if (now - *blind_since_ < kBlindFor || !again) return std::nullopt;
  logged_losses_at_ = now;
  const bool filtered = counts.filtered() > 0 || counts.rows_given_up > 0;
  return Line{filtered ? LogLevel::Warn : LogLevel::Info,
              why_no_blobs(images, counts, seen.levels) + (filtered ? "; see [detect]" : "")};
}

}  // namespace mocap::runtime
