#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/wake_descriptor.h"

namespace mocap::wire {

/// The properties of a node that it announces to other machines.
struct AnnouncedNode {
  std::string name;
  std::uint16_t port = 0;
  bool keys = false;  ///< hosts need a key
};

/// The port of the first of these bound endpoints that other machines reach; 0: none.
std::uint16_t port_for_others(const std::vector<std::string>& endpoints);

/// Announces a node by DNS-SD (RFC 6763) as long as it lives, by the Avahi of this machine, also one that starts later
/// or starts again. Has a thread of its own, because Avahi may answer slowly. If the name is taken in the network, the
/// announcement has the name with " #2" and so on. Without Avahi nothing is announced, which the log says once.
class NodeAnnouncement {
 public:
  explicit NodeAnnouncement(AnnouncedNode node);
  ~NodeAnnouncement();
  NodeAnnouncement(const NodeAnnouncement&) = delete;
  NodeAnnouncement& operator=(const NodeAnnouncement&) = delete;

 private:
  void run(const std::stop_token& stop);

  AnnouncedNode node_;
  WakeDescriptor wake_;
  std::jthread thread_;
};

}  // namespace mocap::wire
