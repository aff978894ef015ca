#include "lib/rigcheck/recorded_spots.h"

#include <algorithm>

namespace mocap::rigcheck {

std::vector<calibration::Picture> spots_of(const std::vector<take::RecordedPicture>& recorded) {
  std::vector<calibration::Picture> images;
  images.reserve(recorded.size());
  for (const take::RecordedPicture& one : recorded) {
    calibration::Picture& image = images.emplace_back();
    image.exposed_at = one.exposed_at;
    for (const Blob& blob : one.blobs) {
      if (!blob.touches_border && !blob.merged) image.spots.push_back({blob.centroid, blob.sigma_px});
    }
  }
  return images;
}

calibration::Take spots_of(const take::BlobRecording& recording) {
  calibration::Take take;
  for (const auto& images : recording.pictures) take.cameras.push_back(spots_of(images));
  return take;
}

calibration::Take last_of(calibration::Take recording, Duration span) {
  Timestamp end = Timestamp::min();
  for (const auto& images : recording.cameras) {
    if (!images.empty()) end = std::max(end, images.back().exposed_at);
  }
  for (auto& images : recording.cameras)
    std::erase_if(images, [&](const calibration::Picture& image) { return end - image.exposed_at > span; });
  return recording;
}

}  // namespace mocap::rigcheck
