#include "cameras/clock/ptp_offset.h"

#include <cmath>

namespace mocap::cameras {

std::optional<MeasuredLine> ptp_offset(const PtpLine& peer, const PtpLine& host) {
  if (peer.grandmaster != host.grandmaster) return std::nullopt;
  const Timestamp host_at = host.at + from_s(to_s(peer.ptp - host.ptp) / (1.0 + host.rate));
  const PeerLine line{peer.at, host_at - peer.at, (1.0 + peer.rate) / (1.0 + host.rate) - 1.0};
  return MeasuredLine{line, from_s(std::hypot(to_s(peer.uncertainty), to_s(host.uncertainty)))};
}

}  // namespace mocap::cameras
