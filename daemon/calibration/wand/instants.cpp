#include "calibration/wand/instants.h"

#include <algorithm>
#include <cstddef>

namespace mocap::calibration {

Duration frame_period(const Take& recording) {
  const auto most = std::ranges::max_element(recording.cameras, {}, &std::vector<Picture>::size);
  if (most == recording.cameras.end() || most->size() < 2) return Duration{0};
  std::vector<Duration> gaps;
  for (std::size_t i = 1; i < most->size(); ++i) gaps.push_back((*most)[i].exposed_at - (*most)[i - 1].exposed_at);
  std::ranges::nth_element(gaps, gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2));
  return gaps[gaps.size() / 2];
}

std::vector<Instant> group_by_instant(const Take& recording, Duration max_skew) {
  struct Exposure {
    Timestamp at;
    std::size_t camera;
    int image;
  };
  std::vector<Exposure> exposures;
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    for (std::size_t i = 0; i < recording.cameras[c].size(); ++i)
      exposures.push_back({recording.cameras[c][i].exposed_at, c, static_cast<int>(i)});
  }
  std::ranges::stable_sort(exposures, {}, &Exposure::at);
  const Duration window = std::min(max_skew, frame_period(recording) / 2);
  std::vector<Instant> instants;
  for (const Exposure& exposure : exposures) {
    const bool joins =
        !instants.empty() && exposure.at - instants.back().at <= window && instants.back().image[exposure.camera] < 0;
    if (!joins) instants.push_back({exposure.at, std::vector<int>(recording.cameras.size(), -1)});
    instants.back().image[exposure.camera] = exposure.image;
  }
  return instants;
}

}  // namespace mocap::calibration
