#include "runtime/report/counters.h"

namespace mocap::runtime {

void DetectionCounters::add(const Detection& detection) noexcept {
  blobs.add(detection.blobs.size());
  too_small.add(detection.too_small);
  too_large.add(detection.too_large);
  not_round.add(detection.not_round);
  too_dim.add(detection.too_dim);
  dropped.add(detection.dropped);
  rows_given_up.add(detection.rows_given_up);
  threshold_grey.set(detection.threshold_grey);
  noise_grey.set(detection.noise_grey);
  background_grey.set(detection.background_grey);
}

DetectionCounts DetectionCounters::counts() const noexcept {
  return {blobs.read(),   too_small.read(), too_large.read(),    not_round.read(),
          too_dim.read(), dropped.read(),   rows_given_up.read()};
}

DetectionLevels DetectionCounters::levels() const noexcept {
  return {threshold_grey.read(), noise_grey.read(), background_grey.read(), brightest_grey.read()};
}

}  // namespace mocap::runtime
