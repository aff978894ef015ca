#include "cameras/clock/exposure_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/log.h"

namespace mocap::cameras {
namespace {

// A clock said to be UTC may be this far from the receipt and still be believed.
constexpr Duration kBelievable = std::chrono::seconds(10);
constexpr Duration kTaiMinusUtc = std::chrono::seconds(37);  // since 2017; no leap second is planned
constexpr int kLearns = 64;                                  // images

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
  if (!std::exchange(doubted_, true)) {
    log_warn("camera " + name_,
             fmt::format("its clock is {:.3f}s off UTC; going on with clock = \"estimated\". Synchronise "
                         "it (PTP) or set that",
                         to_s(ahead)));
  }
  return false;
}

Timestamp ExposureClock::middle_of(const ImageInstants& image, bool synchronised) {
  const Duration half = image.exposure / 2;
  const Duration begin =
      image.stamp - (image.stamp_tells_begin ? Duration::zero() : share(image.exposure, into_exposure_));
  // An image leaves when its exposure is over, so it is the end that the receipts tell. The mapping learns from every
  // image, so that it is ready when the camera's UTC is none any more.
  const Timestamp mapped = mapping_.map(begin + image.exposure, image.first_byte) - delivery_ - half;
  Timestamp middle = mapped - mapped_late_;
  source_ = wants_utc_ ? ClockSource::Lost : ClockSource::Receipts;
  if (wants_utc_ && synchronised) {
    Timestamp told = Timestamp{begin - image.utc_minus_host} + half;
    // A PTP master that keeps to the standard gives TAI, which is ahead of UTC by the leap seconds.
    if (told - image.received > kTaiMinusUtc - kBelievable) told -= kTaiMinusUtc;
    if (believes(told - image.received, image.exposure)) {
      const Duration late = mapped - told;
      mapped_late_ = std::exchange(late_known_, true) ? mapped_late_ + (late - mapped_late_) / kLearns : late;
      middle = told;
      source_ = ClockSource::Camera;
    }
  }
  // Images of one camera keep the order of their exposure, also while the mapping still learns.
  last_ = std::max(middle, last_ + Duration{1});
  return last_;
}

Duration ExposureClock::uncertainty() const {
  return source_ == ClockSource::Camera ? Duration::zero() : mapping_.uncertainty();
}

}  // namespace mocap::cameras
