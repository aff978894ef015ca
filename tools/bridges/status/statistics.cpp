#include "bridges/status/statistics.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace mocap::bridge {

void Statistics::note_added(std::int64_t added_ns) { added_ns_[noted_++ % kKept] = added_ns; }

double Statistics::added_us(std::size_t percent) const {
  const std::size_t count = std::min(noted_, kKept);
  if (count == 0) return 0.0;
  std::array<std::int64_t, kKept> sorted = added_ns_;
  const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>((count - 1) * percent / 100);
  std::nth_element(sorted.begin(), nth, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return static_cast<double>(*nth) * 1e-3;
}

std::string to_json(std::string_view program, const Statistics& counts, const std::vector<Receiver>& receivers,
                    std::string_view diagnosis, const MissedFrames& missed) {
  nlohmann::ordered_json all{{"program", program},
                             {"diagnosis", diagnosis},
                             {"frames", counts.frames},
                             {"feed_lost", missed.lost},
                             {"feed_skipped", missed.skipped},
                             {"losses", counts.losses},
                             {"sent", counts.sent},
                             {"bytes", counts.bytes},
                             {"dropped", counts.dropped},
                             {"requests", counts.requests},
                             {"invalid", counts.invalid},
                             {"added_p50_us", counts.added_us(50)},
                             {"added_p99_us", counts.added_us(99)},
                             {"receivers", nlohmann::ordered_json::array()}};
  for (const Receiver& one : receivers) {
    all["receivers"].push_back({{"address", one.address}, {"settings", one.settings}});
  }
  return all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace mocap::bridge
