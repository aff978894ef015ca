#include "watch/line_writer.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <optional>

namespace mocap::watch {
namespace {

// A stop that is asked between the look at it and poll() is seen after this time.
constexpr int kStopLook_ms = 50;

// A write of more bytes could wait in the kernel although poll() found room: that room is PIPE_BUF bytes or more.
constexpr std::size_t kMostAtOnce_bytes = PIPE_BUF;

}  // namespace

bool LineWriter::write(std::string_view line) const {
  std::optional<Timestamp> give_up;
  while (!line.empty()) {
    if (!give_up && stop_asked_()) give_up = host_now() + kRestOfLine;
    if (give_up && host_now() >= *give_up) return false;
    pollfd room{.fd = descriptor_, .events = POLLOUT, .revents = 0};
    const int found = ::poll(&room, 1, kStopLook_ms);
    if (found < 0 && errno != EINTR) return false;
    if (found <= 0) continue;
    const ssize_t written = ::write(descriptor_, line.data(), std::min(line.size(), kMostAtOnce_bytes));
    if (written < 0 && errno != EINTR && errno != EAGAIN) return false;
    if (written > 0) line.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace mocap::watch
