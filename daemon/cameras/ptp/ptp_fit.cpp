#include "cameras/ptp/ptp_fit.h"

#include <algorithm>
#include <cmath>

namespace mocap::cameras {
namespace {

constexpr std::size_t kFewest = 4;  // two more than a line has parameters
constexpr Duration kLatest = std::chrono::seconds(5);

}  // namespace

void PtpFit::add(std::uint64_t grandmaster, Timestamp at, Duration ptp) {
  if (grandmaster != grandmaster_) readings_.clear();
  grandmaster_ = grandmaster;
  if (!readings_.empty() && at <= readings_.back().at) return;
  if (readings_.size() == kReadings) {
    std::copy(readings_.begin() + 1, readings_.end(), readings_.begin());
    readings_.pop_back();
  }
  readings_.push_back({at, ptp});
}

std::optional<PtpLine> PtpFit::line(Timestamp at) const {
  if (readings_.size() < kFewest || at - readings_.back().at > kLatest) return std::nullopt;
  // Relative to the newest reading: its times since an epoch have more digits than a double.
  const Reading& newest = readings_.back();
  const double count = static_cast<double>(readings_.size());
  const auto age_s = [&](const Reading& reading) { return to_s(reading.at - newest.at); };
  const auto gained_s = [&](const Reading& reading) {
    return to_s((reading.ptp - newest.ptp) - (reading.at - newest.at));
  };
  double mean_age_s = 0.0, mean_gained_s = 0.0;
  for (const Reading& reading : readings_) {
    mean_age_s += age_s(reading) / count;
    mean_gained_s += gained_s(reading) / count;
  }
  double spread_s2 = 0.0, together_s2 = 0.0;
  for (const Reading& reading : readings_) {
    spread_s2 += std::pow(age_s(reading) - mean_age_s, 2);
    together_s2 += (age_s(reading) - mean_age_s) * (gained_s(reading) - mean_gained_s);
  }
  const double rate = together_s2 / spread_s2;
  double residual_s2 = 0.0;
  for (const Reading& reading : readings_) {
    residual_s2 += std::pow(gained_s(reading) - mean_gained_s - rate * (age_s(reading) - mean_age_s), 2);
  }
  const double from_mean_s = to_s(at - newest.at) - mean_age_s;
  const double variance_s2 = residual_s2 / (count - 2.0) * (1.0 / count + from_mean_s * from_mean_s / spread_s2);
  return PtpLine{grandmaster_, at, newest.ptp + (at - newest.at) + from_s(mean_gained_s + rate * from_mean_s), rate,
                 from_s(std::sqrt(variance_s2))};
}

}  // namespace mocap::cameras
