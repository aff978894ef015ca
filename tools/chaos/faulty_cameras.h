#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/time.h"
#include "chaos/episode.h"
#include "model/blob.h"
#include "model/camera_model.h"

namespace mocap::chaos {

/// One image as it reaches the host.
struct Arrival {
  Timestamp first_byte;
  Timestamp received;
  CameraId camera;
  std::uint64_t number = 0;
  Duration stamp{};  ///< begin of the exposure on the camera's clock
  std::vector<Blob> blobs;
};

/// The exposure of all images.
inline constexpr Duration kExposure = std::chrono::milliseconds(1);
/// UTC minus host clock of the simulated host.
inline constexpr Duration kUtcMinusHost = std::chrono::seconds(1'700'000'000);

/// The cameras of an episode with the faults of images, clocks and links: perfect images in, late, wrong and missing
/// ones out.
class FaultyCameras {
 public:
  /// The episode outlives the cameras.
  FaultyCameras(const Episode& episode, const Rig& rig);

  /// Adds the images that are exposed at `t_s`.
  void expose(const std::vector<BlobFrame>& frames, double t_s);

  /// The next image that arrives up to `until`, in the order of arrival; nothing if there is none.
  std::optional<Arrival> next(Timestamp until);

 private:
  struct CameraState {
    Duration clock_offset{};  // camera's clock minus host's
    double last_t_s = 0.0;
    std::optional<Duration> stopped_at;  // ClockStill
  };

  void expose(const BlobFrame& frame, double t_s);
  Duration stamp_of(std::uint32_t camera, Timestamp begin, double t_s);
  std::vector<Blob> image_of(const BlobFrame& frame, double t_s);
  void send(const Arrival& arrival, double t_s);
  bool happens(FaultKind kind, std::uint32_t camera, double t_s);
  const Fault* active(FaultKind kind, std::uint32_t camera, double t_s) const;

  const Episode& episode_;
  Rig rig_;
  scene::Random random_;
  std::vector<CameraState> cameras_;
  std::vector<std::unique_ptr<Arrival>> under_way_;  // by arrival
};

}  // namespace mocap::chaos
