#include "trigger/receivers.h"

#include <fmt/format.h>

#include <algorithm>

#include "trigger/osc_packet.h"

namespace mocap::trigger {
namespace {

constexpr std::size_t kMaxOwn = 64;  // packets of our own that are recognised when they come back

}  // namespace

Receivers::Receivers(const TriggerSettings& settings, std::size_t socket, std::uint64_t first_packet_id)
    : socket_(socket), next_packet_id_(first_packet_id) {
  for (const std::string& receiver : settings.xml_receivers) xml_.push_back(*read_peer(receiver));
  for (const std::string& receiver : settings.osc_receivers) osc_.push_back(*read_peer(receiver));
}

bool Receivers::is_own(const Request& request) const {
  return !request.packet_id.empty() &&
         std::ranges::find(own_, std::pair(request.packet_id, request.name)) != own_.end();
}

bool Receivers::contains(std::uint32_t address) const {
  const auto is_it = [&](const Peer& receiver) { return receiver.address == address; };
  return std::ranges::any_of(xml_, is_it) || std::ranges::any_of(osc_, is_it);
}

std::size_t Receivers::notify(const CapturePacket& packet, const std::set<std::uint32_t>& but,
                              std::vector<Datagram>& packets) {
  const std::size_t notified = notify_xml(packet, but, packets);
  return packet.verb == Verb::Complete ? notified : notified + notify_osc(packet, but, packets);
}

std::size_t Receivers::notify_xml(const CapturePacket& packet, const std::set<std::uint32_t>& but,
                                  std::vector<Datagram>& packets) {
  CapturePacket numbered = packet;
  numbered.packet_id = fmt::format("{}", next_packet_id_);
  std::size_t notified = 0;
  for (const Peer& receiver : xml_) {
    if (but.contains(receiver.address)) continue;
    packets.push_back({socket_, receiver, write_capture(numbered)});
    ++notified;
  }
  if (notified == 0) return 0;
  ++next_packet_id_;
  own_.emplace_back(numbered.packet_id, packet.name);
  if (own_.size() > kMaxOwn) own_.pop_front();
  return notified;
}

std::size_t Receivers::notify_osc(const CapturePacket& packet, const std::set<std::uint32_t>& but,
                                  std::vector<Datagram>& packets) {
  const std::string message = packet.verb == Verb::Start ? write_osc("/RecordStart", {packet.name, ++osc_takes_})
                                                         : write_osc("/RecordStop", {});
  std::size_t notified = 0;
  for (const Peer& receiver : osc_) {
    if (but.contains(receiver.address)) continue;
    packets.push_back({socket_, receiver, message});
    ++notified;
  }
  return notified;
}

}  // namespace mocap::trigger
