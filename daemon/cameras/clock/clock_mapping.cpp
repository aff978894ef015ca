#include "cameras/clock/clock_mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mocap::cameras {
namespace {

constexpr double kBucket_s = 0.5;
// Crystals are within 100 ppm. Two crystals differ by at most 200 ppm; the rest is margin.
constexpr double kMaxDrift = 500e-6;
// A clock does not drift this far between two frames. A larger difference is a jump of the counter.
constexpr double kLeap_s = 0.02;
// After a stall, delivery catches up. A delay that lasts longer than this is a jump of the counter.
constexpr double kLateForGood_s = 2.0;
// Shortest window for a slope: below it the slope is the noise of two delays. A slope that is known from before a jump
// is used for longer.
constexpr double kMinSpan_s = 1.0;
constexpr double kRelearnSpan_s = 10.0;
// With fewer buckets, their lowest samples do not show the distance to the line.
constexpr std::size_t kLeastBuckets = 4;
// Standard deviation of the line, in units of the median height of the buckets' lowest samples above the line, divided
// by the number of buckets. From a simulation of exponential, uniform and half-normal delays at 30 to 200 Hz.
constexpr double kErrorPerHeight = 9.0;
constexpr double kUsualDrift = 50e-6;  // standard deviation of the drift between two crystals
constexpr double kSpreadForgets = 1.0 / 64.0;

}  // namespace

void ClockMapping::reset() {
  begun_ = false;
  slope_known_ = false;
  still_ = 0;
}

void ClockMapping::begin(Duration camera_time, Timestamp received) {
  begun_ = true;
  first_camera_time_ = camera_time;
  first_received_ = received;
  buckets_.clear();
  line_ = Line{};
  late_since_x_ = -1.0;
  spread_s_ = 0.0;
}

void ClockMapping::begin_anew(Duration camera_time, Timestamp received) {
  const bool learnt = !buckets_.empty() && buckets_.back().lowest.x - buckets_.front().lowest.x >= kRelearnSpan_s;
  if (learnt) known_slope_ = line_.slope;
  slope_known_ = slope_known_ || learnt;
  ++leaps_;
  begin(camera_time, received);
}

bool ClockMapping::leapt(const Sample& sample) {
  const double above_s = sample.y - line_.at(sample.x);
  if (above_s < -kLeap_s) return true;
  if (above_s < kLeap_s) {
    late_since_x_ = -1.0;
    return false;
  }
  if (late_since_x_ < 0.0) late_since_x_ = sample.x;
  return sample.x - late_since_x_ > kLateForGood_s;
}

void ClockMapping::remember(const Sample& sample) {
  const auto index = static_cast<std::int64_t>(std::floor(sample.x / kBucket_s));
  const std::int64_t oldest = index - static_cast<std::int64_t>(kWindow) + 1;
  if (!buckets_.empty() && buckets_.front().index < oldest) {
    const auto kept =
        std::find_if(buckets_.begin(), buckets_.end(), [&](const Bucket& b) { return b.index >= oldest; });
    const auto count = static_cast<std::size_t>(buckets_.end() - kept);
    std::copy(kept, buckets_.end(), buckets_.begin());
    buckets_.resize(count);
  }
  if (buckets_.empty() || buckets_.back().index != index) {
    buckets_.push_back({index, sample});
    return;
  }
  Sample& lowest = buckets_.back().lowest;
  if (sample.y - line_.slope * sample.x < lowest.y - line_.slope * lowest.x) lowest = sample;
}

ClockMapping::Line ClockMapping::line_under_samples() const {
  BoundedVector<Sample, kWindow> hull;
  for (const Bucket& bucket : buckets_) {
    const Sample& c = bucket.lowest;
    while (hull.size() >= 2) {
      const Sample& a = hull[hull.size() - 2];
      const Sample& b = hull.back();
      if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0.0) break;  // a, b, c turn left: b is on the hull
      hull.pop_back();
    }
    hull.push_back(c);
  }

  Line line;
  const double middle = 0.5 * (hull.front().x + hull.back().x);
  if (slope_known_) line.slope = known_slope_;
  if (hull.back().x - hull.front().x >= (slope_known_ ? kRelearnSpan_s : kMinSpan_s)) {
    std::size_t i = 1;
    while (i + 1 < hull.size() && hull[i].x < middle) ++i;
    line.slope = std::clamp((hull[i].y - hull[i - 1].y) / (hull[i].x - hull[i - 1].x), -kMaxDrift, kMaxDrift);
  }
  const auto shift_below_samples = [&] {
    line.height = std::numeric_limits<double>::infinity();
    for (const Sample& s : hull) line.height = std::min(line.height, s.y - line.slope * s.x);
  };
  shift_below_samples();
  // A few late samples can give a slope that no pair of crystals has, so the slope is combined with a Gaussian prior on
  // the drift (decisions/0005).
  const double span = hull.back().x - hull.front().x;
  if (span >= kMinSpan_s) {
    const double expected = slope_known_ ? known_slope_ : 0.0;
    const double slope_error = 2.0 * error_of(line) / span;
    line.slope = expected + (line.slope - expected) * kUsualDrift * kUsualDrift /
                                (kUsualDrift * kUsualDrift + slope_error * slope_error);
    shift_below_samples();
  }
  return line;
}

// Standard deviation of the line, s. Uses the median, because a stall of the delivery raises a few buckets.
double ClockMapping::error_of(const Line& line) const {
  BoundedVector<double, kWindow> heights;
  for (const Bucket& bucket : buckets_) heights.push_back(bucket.lowest.y - line.at(bucket.lowest.x));
  const auto middle = heights.begin() + heights.size() / 2;
  std::nth_element(heights.begin(), middle, heights.end());
  return kErrorPerHeight * *middle / static_cast<double>(heights.size());
}

Duration ClockMapping::judge(const Sample& newest) {
  spread_s_ += (newest.y - line_.at(newest.x) - spread_s_) * kSpreadForgets;
  if (buckets_.size() < kLeastBuckets) return from_s(std::max(spread_s_, 0.0));
  return from_s(error_of(line_));
}

Timestamp ClockMapping::map(Duration camera_time, Timestamp received) {
  if (begun_ && camera_time == last_camera_time_) {
    if (++still_ == kStill) ++leaps_;
    uncertainty_ = from_s(spread_s_);
    return received;
  }
  if (!begun_) {
    begin(camera_time, received);
  } else if (camera_time < last_camera_time_ || stands_still()) {
    begin_anew(camera_time, received);
  }
  still_ = 0;
  last_camera_time_ = camera_time;
  const auto sample_of = [&] {
    const Duration camera_span = camera_time - first_camera_time_;
    return Sample{to_s(camera_span), to_s((received - first_received_) - camera_span)};
  };
  Sample sample = sample_of();
  if (!buckets_.empty() && leapt(sample)) {
    begin_anew(camera_time, received);
    sample = sample_of();
  }
  remember(sample);
  line_ = line_under_samples();
  uncertainty_ = judge(sample);
  return received - std::max(Duration::zero(), from_s(sample.y - line_.at(sample.x)));
}

}  // namespace mocap::cameras
