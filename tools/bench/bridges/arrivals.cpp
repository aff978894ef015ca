#include "bench/bridges/arrivals.h"

#include "bench/at_share.h"

namespace mocap::bench {

AddedFigures compare(const Arrivals& subscriber, const Arrivals& receivers, FrameRange range) {
  constexpr double kNanosecond_us = 1e-3;
  AddedFigures figures;
  std::vector<double> added_us;
  for (std::size_t receiver = 0; receiver < receivers.receivers(); ++receiver) {
    for (std::uint64_t frame = range.first; frame <= range.last; ++frame) {
      const std::int64_t at_ns = receivers.at_ns(receiver, frame);
      ++(at_ns == 0 ? figures.lost : figures.frames);
      const std::int64_t sent_ns = subscriber.at_ns(0, frame);
      if (at_ns != 0 && sent_ns != 0) added_us.push_back(kNanosecond_us * static_cast<double>(at_ns - sent_ns));
    }
  }
  figures.p50_us = at_share(added_us, 0.50);
  figures.p99_us = at_share(added_us, 0.99);
  figures.max_us = at_share(added_us, 1.00);
  return figures;
}

}  // namespace mocap::bench
