#pragma once

#include <string>
#include <vector>

#include "mocap_client.hpp"

namespace mocap::bridge {

/// Writes frames of the feed in one foreign protocol. Pure: opens nothing and reads no clock.
class PacketWriter {
 public:
  PacketWriter() = default;
  PacketWriter(const PacketWriter&) = delete;
  PacketWriter& operator=(const PacketWriter&) = delete;
  virtual ~PacketWriter() = default;

  /// The UDP packets of one frame, valid until the next call. `frame` is in the axes that the writer needs; nullptr:
  /// the feed is silent, so nobody is tracked. `time_s` is a time on the sender's clock.
  virtual const std::vector<std::string>& write(const ClientFrame* frame, double time_s) = 0;
};

}  // namespace mocap::bridge
