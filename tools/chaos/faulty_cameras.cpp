#include "chaos/faulty_cameras.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "model/bounds.h"

namespace mocap::chaos {
namespace {

constexpr Duration kDelay = std::chrono::microseconds(300);   // least time from the end of the exposure to the host
constexpr Duration kTransfer = std::chrono::milliseconds(2);  // from the first to the last byte
constexpr double kMeanJitter_s = 50e-6;                       // exponential
constexpr double kSwapDelayPeriods = 1.3;                     // an image that arrives after the next one
constexpr double kLampArea_px2 = 9000.0;
constexpr Duration kTai = std::chrono::seconds(37);  // a PTP clock is ahead of UTC

// A rotation of the camera about its vertical axis, as a shift of the image points of a pinhole camera.
PixelPoint turned(const Lens& lens, const PixelPoint& at, double angle_rad) {
  const Eigen::Vector3d ray((at.v.x() - lens.cx_px) / lens.fx_px, (at.v.y() - lens.cy_px) / lens.fy_px, 1.0);
  const Eigen::Vector3d seen = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()) * ray;
  return {{lens.fx_px * seen.x() / seen.z() + lens.cx_px, lens.fy_px * seen.y() / seen.z() + lens.cy_px}};
}

bool is_in_image(const CameraModel& camera, const PixelPoint& at) {
  return at.v.x() >= 0.0 && at.v.y() >= 0.0 && at.v.x() < camera.width_px && at.v.y() < camera.height_px;
}

}  // namespace

FaultyCameras::FaultyCameras(const Episode& episode, const Rig& rig)
    : episode_(episode), rig_(rig), random_(scene::mixed(episode.seed) + 1), cameras_(rig.size()) {
  for (CameraState& camera : cameras_) {
    camera.clock_offset = episode.utc_stamps ? kUtcMinusHost + kTai : from_s(1000.0 * random_.uniform());
  }
}

const Fault* FaultyCameras::active(FaultKind kind, std::uint32_t camera, double t_s) const {
  return active_fault(episode_.faults, kind, camera, t_s);
}

bool FaultyCameras::happens(FaultKind kind, std::uint32_t camera, double t_s) {
  const Fault* fault = active(kind, camera, t_s);
  return fault != nullptr && random_.uniform() < fault->amount;
}

void FaultyCameras::expose(const std::vector<BlobFrame>& frames, double t_s) {
  for (const BlobFrame& frame : frames) expose(frame, t_s);
}

void FaultyCameras::expose(const BlobFrame& frame, double t_s) {
  const std::uint32_t camera = frame.camera.value;
  const Timestamp begin = frame.exposed_at - kExposure / 2;
  Arrival arrival;
  arrival.camera = frame.camera;
  arrival.number = frame.number;
  arrival.stamp = stamp_of(camera, begin, t_s);
  const double jitter_s = -kMeanJitter_s * std::log(1.0 - random_.uniform());
  arrival.first_byte = begin + kExposure + kDelay + from_s(jitter_s);
  if (active(FaultKind::Unplugged, camera, t_s) != nullptr) return;
  if (happens(FaultKind::FramesLost, camera, t_s)) return;
  if (const Fault* late = active(FaultKind::FramesLate, camera, t_s)) {
    arrival.first_byte += from_s(late->amount * random_.uniform());
  }
  if (happens(FaultKind::FramesSwapped, camera, t_s)) {
    arrival.first_byte += from_s(kSwapDelayPeriods / episode_.rate_hz);
  }
  arrival.received = arrival.first_byte + kTransfer;
  arrival.blobs = image_of(frame, t_s);
  send(arrival, t_s);
}

// The camera's clock: its offset follows steps and drifts; a clock with UTC is right again when its fault ends.
Duration FaultyCameras::stamp_of(std::uint32_t camera, Timestamp begin, double t_s) {
  CameraState& state = cameras_[camera];
  Duration stamp = begin.time_since_epoch() + state.clock_offset;
  if (const Fault* drift = active(FaultKind::ClockDrift, camera, t_s)) {
    stamp += from_s(1e-6 * drift->amount * (t_s - drift->from_s));
  }
  if (const Fault* step = active(FaultKind::ClockStep, camera, t_s)) stamp += from_s(step->amount);
  state.last_t_s = t_s;
  if (active(FaultKind::ClockStill, camera, t_s) == nullptr) {
    state.stopped_at.reset();
  } else if (!state.stopped_at) {
    state.stopped_at = stamp;
  }
  return state.stopped_at.value_or(stamp);
}

std::vector<Blob> FaultyCameras::image_of(const BlobFrame& frame, double t_s) {
  const std::uint32_t camera = frame.camera.value;
  const CameraModel& model = rig_[camera];
  std::vector<Blob> blobs;
  if (active(FaultKind::Dazzled, camera, t_s) != nullptr) {
    Blob& lamp = blobs.emplace_back();
    lamp.centroid = {{0.5 * model.width_px, 0.5 * model.height_px}};
    lamp.area_px2 = kLampArea_px2;
    lamp.peak = lamp.saturated = 1.0;
    return blobs;
  }
  const Fault* bump = active(FaultKind::Bumped, camera, t_s);
  for (Blob blob : frame.blobs) {
    if (bump != nullptr) blob.centroid = turned(model.lens, blob.centroid, bump->amount * std::numbers::pi / 180.0);
    if (is_in_image(model, blob.centroid)) blobs.push_back(blob);
  }
  const Fault* storm = active(FaultKind::NoiseStorm, camera, t_s);
  const std::size_t wanted = storm == nullptr ? 0 : static_cast<std::size_t>(storm->amount);
  while (blobs.size() < std::min(wanted, kMaxBlobs)) {
    Blob& noise = blobs.emplace_back();
    noise.centroid = {{random_.uniform() * model.width_px, random_.uniform() * model.height_px}};
    noise.area_px2 = 1.0 + 20.0 * random_.uniform();
    noise.peak = random_.uniform();
  }
  std::ranges::stable_sort(blobs, {}, [](const Blob& blob) { return blob.centroid.v.y(); });
  return blobs;
}

void FaultyCameras::send(const Arrival& arrival, double t_s) {
  const auto put = [this](const Arrival& sent) {
    const auto later =
        std::ranges::upper_bound(under_way_, sent.received, {}, [](const auto& waiting) { return waiting->received; });
    under_way_.insert(later, std::make_unique<Arrival>(sent));
  };
  put(arrival);
  if (!happens(FaultKind::FramesRepeated, arrival.camera.value, t_s)) return;
  Arrival again = arrival;
  again.first_byte += kTransfer;
  again.received += kTransfer;
  put(again);
}

std::optional<Arrival> FaultyCameras::next(Timestamp until) {
  if (under_way_.empty() || under_way_.front()->received > until) return std::nullopt;
  Arrival first = std::move(*under_way_.front());
  under_way_.erase(under_way_.begin());
  return first;
}

}  // namespace mocap::chaos
