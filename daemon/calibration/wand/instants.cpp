#include "calibration/wand/instants.h"

#include <algorithm>
#include <cstddef>

namespace mocap::calibration {

Duration period_of(const Take& take) {
  const auto most = std::ranges::max_element(take.cameras, {}, &std::vector<Picture>::size);
  if (most == take.cameras.end() || most->size() < 2) return Duration{0};
  std::vector<Duration> gaps;
  for (std::size_t i = 1; i < most->size(); ++i) gaps.push_back((*most)[i].exposed_at - (*most)[i - 1].exposed_at);
  std::ranges::nth_element(gaps, gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2));
  return gaps[gaps.size() / 2];
}

std::vector<Instant> gather_instants(const Take& take, Duration most_skew) {
  struct Exposure {
    Timestamp at;
    std::size_t camera;
    int picture;
  };
  std::vector<Exposure> exposures;
  for (std::size_t c = 0; c < take.cameras.size(); ++c) {
    for (std::size_t i = 0; i < take.cameras[c].size(); ++i)
      exposures.push_back({take.cameras[c][i].exposed_at, c, static_cast<int>(i)});
  }
  std::ranges::stable_sort(exposures, {}, &Exposure::at);
  const Duration reach = std::min(most_skew, period_of(take) / 2);
  std::vector<Instant> instants;
  for (const Exposure& one : exposures) {
    const bool joins =
        !instants.empty() && one.at - instants.back().at <= reach && instants.back().picture[one.camera] < 0;
    if (!joins) instants.push_back({one.at, std::vector<int>(take.cameras.size(), -1)});
    instants.back().picture[one.camera] = one.picture;
  }
  return instants;
}

}  // namespace mocap::calibration
