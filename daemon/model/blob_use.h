#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace mocap {

/// Blobs of one camera in the fused sets, and those of them that are views of a 3D marker.
struct BlobUse {
  std::uint64_t blobs = 0;
  std::uint64_t in_markers = 0;

  BlobUse since(const BlobUse& before) const noexcept { return {blobs - before.blobs, in_markers - before.in_markers}; }
  /// Share of the blobs that are views of a 3D marker, 0 to 1; nothing without blobs.
  std::optional<double> share() const noexcept;
};

/// Why a camera contributes nothing to the 3D markers although the other cameras do: "3 % of its blobs are in 3D
/// markers, 87 % of those of the other cameras". `cameras`: all cameras, over the same second or more. Empty if the
/// camera contributes, if the other cameras do not agree either, or with fewer than three cameras.
std::string why_no_markers(std::span<const BlobUse> cameras, std::size_t camera);

/// The remedy that goes with it. The daemon holds its cameras: verify can run them only while the capture rests.
inline constexpr const char* kNoMarkersRemedy =
    "for the cause: mocapctl capture stop; mocap-calibrate verify --config FILE; mocapctl capture start";

}  // namespace mocap
