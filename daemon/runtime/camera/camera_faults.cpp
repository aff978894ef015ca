#include "runtime/camera/camera_faults.h"

#include <fmt/format.h>

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kRepeatFaultAfter = std::chrono::minutes(1);

struct Message {
  std::uint64_t CameraHealth::*count;
  const char* what;
  const char* remedy;
};

// One entry for each kind of fault: its counter, the message after the increase of the counter, and the remedy.
constexpr std::array<Message, CameraFaults::kKinds> kMessages{{
    {&CameraHealth::missing_frames, "images never came",
     "use larger packets (an MTU of 9000 and packet_size_bytes) or a lower rate_hz; see mocapctl doctor; of a node: "
     "its machine or the network is too slow for its cameras"},
    {&CameraHealth::failed_frames, "images came incomplete or were refused",
     "the line 'unusable image' of this camera has the reason; if packets are missing, check net.core.rmem_max, MTU "
     "and link speed with mocapctl doctor; if the clock of a node is uncertain, see clock_uncertainty_us"},
    {&CameraHealth::missing_packets, "packets never came",
     "check cable and switch, and net.core.rmem_max with mocapctl doctor; of a node: each is an image that was lost on "
     "the way, or that came while this host started the camera again"},
    {&CameraHealth::underruns, "images arrived while no buffer was free",
     "increase stream_buffers (or buffers), or connect fewer cameras to one processor"},
    {&CameraHealth::dropped_queue_full, "images dropped, the queue to the fusion was full",
     "the machine is too slow for these cameras: lower rate_hz, or increase [queues] camera_frames"},
    {&CameraHealth::repeated_frames, "images came a second time and were dropped",
     "the network or the camera repeats packets: look for a loop between switches, and for new firmware"},
    {&CameraHealth::clock_leaps, "times its clock jumped, ran back or stopped",
     "exposure times are less accurate for some seconds; if this recurs, look for new firmware, or for the fault in "
     "the program that stamps the images, and use PTP if the driver has it"},
}};

}  // namespace

void CameraFaults::report(const CameraHealth& now, Timestamp at) {
  for (std::size_t i = 0; i < kKinds; ++i) {
    const std::uint64_t count = now.*kMessages[i].count;
    Kind& kind = kinds_[i];
    if (count < kind.logged) kind.logged = 0;  // the camera was replaced
    if (count <= kind.logged || (kind.logged_at && at - *kind.logged_at < kRepeatFaultAfter)) continue;
    log_warn("camera " + now.name,
             fmt::format("{} {} total={}; {}", count - kind.logged, kMessages[i].what, count, kMessages[i].remedy));
    kind = {count, at};
  }
}

}  // namespace mocap::runtime
