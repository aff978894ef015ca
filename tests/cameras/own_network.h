#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

namespace mocap::cameras {

/// Moves this process (its first thread, and all threads that it starts later) into a new network namespace with
/// loopback only: 127.0.0.1 and 127.0.0.2 to 127.0.0.`cameras + 1`. Returns the reason of a failure, or an empty text.
inline std::string enter_own_network(int cameras) {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return std::string("this system gives no network namespace: ") + std::strerror(errno);
  }
  const int handle = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::string failed;
  for (int i = 0; i <= cameras && failed.empty(); ++i) {
    ifreq request{};
    std::snprintf(request.ifr_name, sizeof request.ifr_name, i == 0 ? "lo" : "lo:%d", i);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(0x7F000001U + static_cast<unsigned>(i));
    std::memcpy(&request.ifr_addr, &address, sizeof address);
    if (i > 0 && ioctl(handle, SIOCSIFADDR, &request) != 0) failed = std::strerror(errno);
    request.ifr_flags = IFF_UP;
    if (i == 0 && ioctl(handle, SIOCSIFFLAGS, &request) != 0) failed = std::strerror(errno);
  }
  close(handle);
  return failed.empty() ? "" : "cannot give loopback its addresses: " + failed;
}

}  // namespace mocap::cameras
