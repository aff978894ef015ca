#include "cameras/clock/exposure_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/log.h"

namespace mocap::cameras {
namespace {

// Largest difference of the stamp and the time of receipt at which the clock is accepted as UTC.
constexpr Duration kBelievable = std::chrono::seconds(10);
constexpr int kOffsetSmoothing = 64;  // images of the running mean

double into_exposure(const std::string& stamps) {
  if (stamps == "start") return 0.0;
  return stamps == "middle" ? 0.5 : 1.0;
}

Duration share(Duration span, double of) {
  return Duration{static_cast<Duration::rep>(of * static_cast<double>(span.count()))};
}

}  // namespace

ExposureClock::ExposureClock(std::string name, const AravisSettings& settings)
    : name_(std::move(name)),
      wants_utc_(settings.clock == "utc"),
      delivery_(from_s(settings.delivery_us * 1e-6)),
      into_exposure_(into_exposure(settings.stamps)) {}

void ExposureClock::reset() {
  mapping_.reset();
  late_known_ = false;
  mapped_late_ = {};
}

bool ExposureClock::believes(Duration ahead, Duration exposure) {
  if (ahead <= exposure && ahead > -kBelievable) return true;
  if (!std::exchange(warned_, true)) {
    log_warn("camera " + name_,
             fmt::format("its clock is {:.3f}s off UTC; clock = \"estimated\" is used instead. Synchronise "
                         "it (PTP), or set clock = \"estimated\"",
                         to_s(ahead)));
  }
  return false;
}

Timestamp ExposureClock::middle_of(const ImageInstants& image, bool synchronised) {
  const Duration half = image.exposure / 2;
  const Duration begin =
      image.stamp - (image.stamp_tells_begin ? Duration::zero() : share(image.exposure, into_exposure_));
  // An image is sent when its exposure ends, so the mapping uses the end of the exposure. Every image is added, so that
  // the mapping is ready when the camera's UTC becomes invalid.
  const Timestamp mapped = mapping_.map(begin + image.exposure, image.first_byte) - delivery_ - half;
  Timestamp middle = mapped - mapped_late_;
  source_ = wants_utc_ ? ClockSource::Lost : ClockSource::Receipts;
  if (wants_utc_ && synchronised) {
    Timestamp by_camera = Timestamp{begin - image.utc_minus_host} + half;
    // A PTP master that follows the standard distributes TAI, which is ahead of UTC by the leap seconds.
    if (by_camera - image.received > kTaiMinusUtc - kBelievable) by_camera -= kTaiMinusUtc;
    if (believes(by_camera - image.received, image.exposure)) {
      const Duration late = mapped - by_camera;
      mapped_late_ = std::exchange(late_known_, true) ? mapped_late_ + (late - mapped_late_) / kOffsetSmoothing : late;
      middle = by_camera;
      source_ = ClockSource::Camera;
    }
  }
  // Exposures of one camera must increase, also while the mapping converges.
  last_ = std::max(middle, last_ + Duration{1});
  return last_;
}

Duration ExposureClock::uncertainty() const {
  return source_ == ClockSource::Camera ? Duration::zero() : mapping_.uncertainty();
}

}  // namespace mocap::cameras
