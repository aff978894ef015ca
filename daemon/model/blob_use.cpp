#include "model/blob_use.h"

#include <fmt/format.h>

namespace mocap {
namespace {

// Fewer blobs say nothing: with a share of one half, less than 10 % of 50 happen once in 1e9 sets.
constexpr std::uint64_t kMinBlobs = 50;
// With two cameras each marker counts for both: the camera with more false blobs would be blamed.
constexpr std::size_t kMinCameras = 3;
// The shares were measured on five simulated cameras, 18 and 41 markers, walking, over one second each: a camera that
// is exchanged, turned, upside down, mirrored or has another lens has 0 to 15 %, by accidental intersections of its
// rays; a camera that fits 81 to 100 %, all others together 63 % and more. A camera that is one frame late has 10 to 94
// %: its share depends on the speed of the markers.
constexpr double kIdleShare = 0.25;
constexpr double kUsualShare = 0.5;

}  // namespace

std::optional<double> BlobUse::share() const noexcept {
  if (blobs == 0) return std::nullopt;
  return static_cast<double>(in_markers) / static_cast<double>(blobs);
}

std::string why_no_markers(std::span<const BlobUse> cameras, std::size_t camera) {
  if (cameras.size() < kMinCameras) return {};
  const BlobUse& own = cameras[camera];
  BlobUse others;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (c == camera) continue;
    others.blobs += cameras[c].blobs;
    others.in_markers += cameras[c].in_markers;
  }
  if (own.blobs < kMinBlobs || others.blobs < kMinBlobs) return {};
  if (*own.share() > kIdleShare || *others.share() < kUsualShare) return {};
  return fmt::format("{:.0f} % of its blobs are in 3D markers, {:.0f} % of those of the other cameras",
                     100.0 * *own.share(), 100.0 * *others.share());
}

}  // namespace mocap
