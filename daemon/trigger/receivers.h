#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "trigger/ip4.h"
#include "trigger/request.h"
#include "trigger/trigger_settings.h"
#include "trigger/xml_packet.h"

namespace mocap::trigger {

/// The programs that are notified about our takes, in XML or in OSC. Opens nothing.
class Receivers {
 public:
  /// `socket`: index of the socket that sends. The packets are numbered from `first_packet_id` on.
  Receivers(const TriggerSettings& settings, std::size_t socket, std::uint64_t first_packet_id);

  /// Appends a packet for each receiver, except those at the addresses `but`. Returns their number. OSC knows no
  /// packet for Verb::Complete.
  std::size_t notify(const CapturePacket& packet, const std::set<std::uint32_t>& but, std::vector<Datagram>& packets);

  /// Whether this is one of the last 64 packets of notify(): an answer to it has its PacketID and name.
  bool is_own(const Request& request) const;
  /// Whether a receiver has this address.
  bool contains(std::uint32_t address) const;

 private:
  std::size_t notify_xml(const CapturePacket& packet, const std::set<std::uint32_t>& but,
                         std::vector<Datagram>& packets);
  std::size_t notify_osc(const CapturePacket& packet, const std::set<std::uint32_t>& but,
                         std::vector<Datagram>& packets);

  std::vector<Peer> xml_, osc_;
  std::size_t socket_;
  std::deque<std::pair<std::string, std::string>> own_;  // PacketID and name
  std::uint64_t next_packet_id_;
  std::int32_t osc_takes_ = 0;
};

}  // namespace mocap::trigger
