#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "base/time.h"

namespace mocap::cameras {

/// The statement of ptp4l about the clock that it measures or disciplines.
struct PmcAnswer {
  std::uint64_t grandmaster = 0;
  Duration offset{};                 ///< this clock minus the grandmaster's
  std::optional<Duration> measured;  ///< when the offset held, on this clock; empty: this clock is the grandmaster's
};

/// Reads what `pmc 'GET TIME_STATUS_NP' 'GET PORT_DATA_SET'` prints (linuxptp 3.1 to 4). Fails with NotFound if nobody
/// answered (the message has the first report of pmc), or if no port has a master or is one: the message names the
/// states of the ports.
Result<PmcAnswer> parse_pmc(std::string_view text);

}  // namespace mocap::cameras
