#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::bridge {

/// One receiver of a bridge, for people.
struct Receiver {
  std::string address;   ///< ADDRESS:PORT, or the group of a multicast
  std::string settings;  ///< "4.1 unicast y-up", "udp", ...
};

/// Counts since the start of a bridge. One thread.
class Statistics {
 public:
  std::uint64_t frames = 0;    ///< from the feed
  std::uint64_t sent = 0;      ///< packets
  std::uint64_t bytes = 0;     ///< sent
  std::uint64_t dropped = 0;   ///< packets that the kernel did not take: a full buffer, or no receiver at that port
  std::uint64_t requests = 0;  ///< from receivers, understood
  std::uint64_t invalid = 0;   ///< packets from receivers that are no valid requests
  std::uint64_t losses = 0;    ///< times that the feed fell silent

  /// Notes the time from the arrival of a frame in this program until its last packet was sent.
  void note_added(std::int64_t added_ns);
  /// Percentile of the newest 4096 noted times, us; 0 if there is none.
  double added_us(std::size_t percent) const;

 private:
  static constexpr std::size_t kKept = 4096;
  std::array<std::int64_t, kKept> added_ns_{};
  std::size_t noted_ = 0;
};

/// Frames of the feed that the bridge did not process.
struct MissedFrames {
  std::uint64_t lost = 0;     ///< between daemon and bridge
  std::uint64_t skipped = 0;  ///< received, but replaced by newer frames because the bridge was late
};

/// One line of JSON with all counts, the receivers, the reason why no data arrives and the missed frames.
std::string to_json(std::string_view program, const Statistics& counts, const std::vector<Receiver>& receivers,
                    std::string_view diagnosis, const MissedFrames& missed);

}  // namespace mocap::bridge
