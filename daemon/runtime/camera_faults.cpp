#include "runtime/camera_faults.h"

#include <fmt/format.h>

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kTellAgain = std::chrono::minutes(1);

struct Words {
  std::uint64_t CameraHealth::*count;
  const char* what;
  const char* cure;
};

// One line a kind: what to say of `count` more of them, and what mends it.
constexpr std::array<Words, CameraFaults::kKinds> kWords{{
    {&CameraHealth::missing_frames, "images never came",
     "larger packets (an MTU of 9000 and packet_size_bytes), a lower rate_hz, or what mocapctl doctor finds"},
    {&CameraHealth::failed_frames, "images came broken",
     "packets are lost on the way: see what mocapctl doctor says of net.core.rmem_max, MTU and link speed"},
    {&CameraHealth::missing_packets, "packets never came, although they were asked for again",
     "look at cable and switch, and at what mocapctl doctor says of net.core.rmem_max"},
    {&CameraHealth::underruns, "packets found every buffer in use",
     "a larger stream_buffers (or buffers), or fewer cameras a processor"},
    {&CameraHealth::dropped_queue_full, "images' blobs found no room on the way to the fusion",
     "the machine is too slow for these cameras: a lower rate_hz, or [queues] camera_frames"},
    {&CameraHealth::repeated_frames, "images came a second time and were left out",
     "the network or the camera repeats packets: look for a loop between switches, and for new firmware"},
    {&CameraHealth::clock_leaps, "times its clock leapt, ran back or stood still",
     "times are learnt anew and are worse for some seconds; where it goes on, PTP or new firmware"},
}};

}  // namespace

void CameraFaults::tell(const CameraHealth& now, Timestamp at) {
  for (std::size_t i = 0; i < kKinds; ++i) {
    const std::uint64_t count = now.*kWords[i].count;
    Kind& kind = kinds_[i];
    if (count <= kind.told || (kind.told_at && at - *kind.told_at < kTellAgain)) continue;
    log_warn("camera " + now.name,
             fmt::format("{} {} total={}; {}", count - kind.told, kWords[i].what, count, kWords[i].cure));
    kind = {count, at};
  }
}

}  // namespace mocap::runtime
