#include "synchronise/exposure_watch.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::synchronise {
namespace {

constexpr double kMemory_s = 5.0;   // what is older hardly counts
constexpr double kLongest_s = 1.0;  // a clock that is silent for longer is replaced
// Before so many frames and seconds nothing is told.
constexpr std::uint64_t kFewFrames = 30;
constexpr double kShort_s = 2.0;
// Crystals differ by 5 to 100 us/s; cameras on one trigger or one PTP clock do not.
constexpr double kSameDrift = 4e-6;
constexpr double kDriftSigmas = 6.0;

double wrapped(double offset_s, double period_s) {
  return period_s > 0.0 ? offset_s - period_s * std::round(offset_s / period_s) : offset_s;
}

}  // namespace

void ExposureWatch::Line::add(double at_s, double offset_s) {
  const double fade = count == 0 ? 0.0 : std::exp(-(at_s - last_s) / kMemory_s);
  weight = fade * weight + 1.0;
  const double off_s = at_s - mean_s;
  const double off_offset_s = offset_s - mean_offset_s;
  mean_s += off_s / weight;
  mean_offset_s += off_offset_s / weight;
  tt = fade * tt + off_s * (at_s - mean_s);
  to = fade * to + off_s * (offset_s - mean_offset_s);
  oo = fade * oo + off_offset_s * (offset_s - mean_offset_s);
  last_s = at_s;
  last_offset_s = offset_s;
  ++count;
}

double ExposureWatch::Line::jitter_s() const {
  return weight > 0.0 ? std::sqrt(std::max(0.0, oo - drift() * to) / weight) : 0.0;
}

double ExposureWatch::Line::drift_sigma() const { return tt > 0.0 ? jitter_s() / std::sqrt(tt) : 0.0; }

ExposureWatch::ExposureWatch(Duration window, std::size_t camera_count)
    : window_s_(to_s(window)), cameras_(camera_count), timings_(camera_count) {
  MOCAP_EXPECTS(camera_count >= 1 && camera_count <= kMaxCameras);
}

void ExposureWatch::forget(CameraId camera) {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  cameras_[camera.value] = {};
  timings_[camera.value] = {};
  if (clock_ == camera.value) clock_.reset();
}

void ExposureWatch::take_for_clock(std::uint32_t camera) {
  clock_ = camera;
  for (Own& own : cameras_) own.line = {};
}

// Lost frames make a step of several periods; of the first few steps one at least is a single one.
void ExposureWatch::follow_period(Own& own, Timestamp exposed_at) {
  constexpr double kRate = 0.05;
  if (own.last) {
    const double step_s = to_s(exposed_at - *own.last);
    if (own.frames <= kFirstFrames) {
      // The middle one: images are left out, and a clock that is still being learnt makes steps too short.
      own.first_steps_s[own.frames - 1] = step_s;
      const auto end = own.first_steps_s.begin() + static_cast<std::ptrdiff_t>(own.frames);
      std::array<double, kFirstFrames> sorted{};
      const auto sorted_end = std::copy(own.first_steps_s.begin(), end, sorted.begin());
      const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((own.frames - 1) / 2);
      std::nth_element(sorted.begin(), middle, sorted_end);
      own.period_s = *middle;
    } else {
      const double periods = std::max(1.0, std::round(step_s / own.period_s));
      own.period_s += kRate * (step_s / periods - own.period_s);
    }
  }
  own.last = exposed_at;
  ++own.frames;
}

void ExposureWatch::see(CameraId camera, Timestamp exposed_at) {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  Own& own = cameras_[camera.value];
  if (!origin_) origin_ = exposed_at;
  if (own.last && exposed_at <= *own.last) {  // its clock was set back
    forget(camera);
  }
  now_ = std::max(now_, exposed_at);
  follow_period(own, exposed_at);
  if (!clock_ || to_s(exposed_at - *cameras_[*clock_].last) > kLongest_s) take_for_clock(camera.value);
  const Own& clock = cameras_[*clock_];
  if (clock.frames < 2 * kFirstFrames) return;
  const double phase_s = wrapped(to_s(exposed_at - *clock.last), clock.period_s);
  Line& line = own.line;
  // The offset goes on where it was: phases are alike after whole periods.
  const double periods = line.count == 0 ? 0.0 : std::round((line.last_offset_s - phase_s) / clock.period_s);
  line.add(seconds(exposed_at), phase_s + periods * clock.period_s);
}

bool ExposureWatch::is_told(const Own& own) const {
  if (!own.last || own.line.count < kFewFrames || to_s(now_ - *own.last) > kLongest_s) return false;
  return own.line.tt > own.line.weight * kShort_s * kShort_s / 12.0;
}

// How much later `a` exposes than `b` now.
double ExposureWatch::apart_s(const Own& a, const Own& b) const {
  const double now_s = seconds(now_);
  return wrapped(a.line.at(now_s) - b.line.at(now_s), cameras_[*clock_].period_s);
}

bool ExposureWatch::agree(const Own& a, const Own& b) const {
  const double same = kSameDrift + kDriftSigmas * std::hypot(a.line.drift_sigma(), b.line.drift_sigma());
  return std::abs(apart_s(a, b)) <= window_s_ && std::abs(a.line.drift() - b.line.drift()) <= same;
}

// The camera with which most others agree.
std::uint32_t ExposureWatch::centre_of_group() const {
  std::uint32_t centre = 0;
  std::size_t most = 0;
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    if (!is_told(cameras_[c])) continue;
    const auto with_it = static_cast<std::size_t>(
        std::ranges::count_if(cameras_, [&](const Own& other) { return is_told(other) && agree(cameras_[c], other); }));
    if (with_it > most) {
      most = with_it;
      centre = c;
    }
  }
  return centre;
}

void ExposureWatch::assess() {
  if (!clock_) return;
  const Own& centre = cameras_[centre_of_group()];
  double group = 0.0;
  double offset_s = 0.0;
  double drift = 0.0;
  for (const Own& own : cameras_) {
    if (!is_told(own) || !is_told(centre) || !agree(own, centre)) continue;
    group += 1.0;
    offset_s += apart_s(own, centre);
    drift += own.line.drift();
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const Own& own = cameras_[c];
    CameraTiming& timing = timings_[c];
    timing = {};
    timing.rate_hz = own.period_s > 0.0 ? 1.0 / own.period_s : 0.0;
    timing.told = is_told(own) && group > 0.0;
    if (!timing.told) continue;
    timing.synchronised = agree(own, centre);
    timing.offset = from_s(wrapped(apart_s(own, centre) - offset_s / group, cameras_[*clock_].period_s));
    timing.drift_us_s = 1e6 * (own.line.drift() - drift / group);
    timing.jitter = from_s(own.line.jitter_s());
  }
}

}  // namespace mocap::synchronise
