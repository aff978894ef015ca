#include "synchronise/exposure_watch.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::synchronise {
namespace {

constexpr double kMemory_s = 5.0;           // time constant of the exponential weights
constexpr double kMaxClockSilence_s = 1.0;  // a reference camera without frames for longer is replaced
// A camera is assessed only after this many frames and seconds.
constexpr std::uint64_t kMinFrames = 30;
constexpr double kMinSpan_s = 2.0;
// Crystals differ by 5 to 100 us/s; cameras on one trigger or one PTP clock do not.
constexpr double kMaxDriftDifference = 4e-6;
constexpr double kDriftSigmas = 6.0;

double wrapped(double offset_s, double period_s) {
  return period_s > 0.0 ? offset_s - period_s * std::round(offset_s / period_s) : offset_s;
}

}  // namespace

void ExposureWatch::Line::add(double at_s, double offset_s) {
  const double decay = count == 0 ? 0.0 : std::exp(-(at_s - last_s) / kMemory_s);
  weight = decay * weight + 1.0;
  const double off_s = at_s - mean_s;
  const double off_offset_s = offset_s - mean_offset_s;
  mean_s += off_s / weight;
  mean_offset_s += off_offset_s / weight;
  tt = decay * tt + off_s * (at_s - mean_s);
  to = decay * to + off_s * (offset_s - mean_offset_s);
  oo = decay * oo + off_offset_s * (offset_s - mean_offset_s);
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

void ExposureWatch::set_reference_clock(std::uint32_t camera) {
  clock_ = camera;
  for (ObservedCamera& state : cameras_) state.line = {};
}

// Estimates the frame period of a camera: first the median of the time steps between frames, then exponential
// smoothing. A lost frame makes a step of several periods, which is divided by the rounded number of periods.
void ExposureWatch::follow_period(ObservedCamera& state, Timestamp exposed_at) {
  constexpr double kPeriodRate = 0.05;
  if (state.last) {
    const double step_s = to_s(exposed_at - *state.last);
    if (state.frames <= kFirstFrames) {
      // The median ignores steps over lost frames and too short steps while the camera's clock is still being
      // estimated.
      state.first_steps_s[state.frames - 1] = step_s;
      const auto end = state.first_steps_s.begin() + static_cast<std::ptrdiff_t>(state.frames);
      std::array<double, kFirstFrames> sorted{};
      const auto sorted_end = std::copy(state.first_steps_s.begin(), end, sorted.begin());
      const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((state.frames - 1) / 2);
      std::nth_element(sorted.begin(), middle, sorted_end);
      state.period_s = *middle;
    } else {
      const double periods = std::max(1.0, std::round(step_s / state.period_s));
      state.period_s += kPeriodRate * (step_s / periods - state.period_s);
    }
  }
  state.last = exposed_at;
  ++state.frames;
}

void ExposureWatch::see(CameraId camera, Timestamp exposed_at) {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  ObservedCamera& state = cameras_[camera.value];
  if (!origin_) origin_ = exposed_at;
  if (state.last && exposed_at <= *state.last) {  // the camera's clock was set back
    forget(camera);
  }
  now_ = std::max(now_, exposed_at);
  follow_period(state, exposed_at);
  if (!clock_ || to_s(exposed_at - *cameras_[*clock_].last) > kMaxClockSilence_s) set_reference_clock(camera.value);
  const ObservedCamera& clock = cameras_[*clock_];
  if (clock.frames < 2 * kFirstFrames) return;
  const double phase_s = wrapped(to_s(exposed_at - *clock.last), clock.period_s);
  Line& line = state.line;
  // Phases repeat after each period: choose the number of periods that continues the last offset.
  const double periods = line.count == 0 ? 0.0 : std::round((line.last_offset_s - phase_s) / clock.period_s);
  line.add(seconds(exposed_at), phase_s + periods * clock.period_s);
}

bool ExposureWatch::is_known(const ObservedCamera& state) const {
  if (!state.last || state.line.count < kMinFrames || to_s(now_ - *state.last) > kMaxClockSilence_s) return false;
  return state.line.tt > state.line.weight * kMinSpan_s * kMinSpan_s / 12.0;
}

// Returns by how much `a` exposes later than `b` at `now_`, within half a period.
double ExposureWatch::offset_difference_s(const ObservedCamera& a, const ObservedCamera& b) const {
  const double now_s = seconds(now_);
  return wrapped(a.line.at(now_s) - b.line.at(now_s), cameras_[*clock_].period_s);
}

bool ExposureWatch::agree(const ObservedCamera& a, const ObservedCamera& b) const {
  const double same = kMaxDriftDifference + kDriftSigmas * std::hypot(a.line.drift_sigma(), b.line.drift_sigma());
  return std::abs(offset_difference_s(a, b)) <= window_s_ && std::abs(a.line.drift() - b.line.drift()) <= same;
}

// Returns the camera with which most other cameras agree.
std::uint32_t ExposureWatch::centre_of_largest_group() const {
  std::uint32_t centre = 0;
  std::size_t most = 0;
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    if (!is_known(cameras_[c])) continue;
    const auto with_it = static_cast<std::size_t>(std::ranges::count_if(
        cameras_, [&](const ObservedCamera& other) { return is_known(other) && agree(cameras_[c], other); }));
    if (with_it > most) {
      most = with_it;
      centre = c;
    }
  }
  return centre;
}

void ExposureWatch::assess() {
  if (!clock_) return;
  const ObservedCamera& centre = cameras_[centre_of_largest_group()];
  double group = 0.0;
  double offset_s = 0.0;
  double drift = 0.0;
  for (const ObservedCamera& state : cameras_) {
    if (!is_known(state) || !is_known(centre) || !agree(state, centre)) continue;
    group += 1.0;
    offset_s += offset_difference_s(state, centre);
    drift += state.line.drift();
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const ObservedCamera& state = cameras_[c];
    CameraTiming& timing = timings_[c];
    timing = {};
    timing.rate_hz = state.period_s > 0.0 ? 1.0 / state.period_s : 0.0;
    timing.is_known = is_known(state) && group > 0.0;
    if (!timing.is_known) continue;
    timing.synchronised = agree(state, centre);
    timing.offset = from_s(wrapped(offset_difference_s(state, centre) - offset_s / group, cameras_[*clock_].period_s));
    timing.drift_us_s = 1e6 * (state.line.drift() - drift / group);
    timing.jitter = from_s(state.line.jitter_s());
  }
}

}  // namespace mocap::synchronise
