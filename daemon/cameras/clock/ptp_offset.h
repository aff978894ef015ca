#pragma once

#include <optional>

#include "cameras/clock/peer_clock.h"
#include "model/clock/ptp_line.h"

namespace mocap::cameras {

/// The host's clock over the peer's clock by PTP. `peer.at`: the instant of the peer for which the line is made. Empty
/// if the clocks do not follow one grandmaster.
std::optional<MeasuredLine> ptp_offset(const PtpLine& peer, const PtpLine& host);

}  // namespace mocap::cameras
