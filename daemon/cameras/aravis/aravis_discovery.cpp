#include "cameras/aravis/aravis_discovery.h"
#include "cameras/aravis/glib_text.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>

namespace mocap::cameras {
namespace {

constexpr std::uint16_t kGvcpPort = 3956;
// Key 0x42, flags "acknowledge", command DISCOVERY_CMD, no payload, request 1.
constexpr std::array<std::uint8_t, 8> kDiscoveryCommand{0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01};
constexpr std::uint8_t kDiscoveryAcknowledge = 0x03;

class Socket {
 public:
  Socket() : handle_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (handle_ >= 0) close(handle_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int get() const { return handle_; }

 private:
  int handle_;
};

bool acknowledged(int handle, Duration patience) {
  pollfd waiting{handle, POLLIN, 0};
  const auto patience_ms = std::chrono::duration_cast<std::chrono::milliseconds>(patience).count();
  if (poll(&waiting, 1, static_cast<int>(patience_ms)) != 1) return false;
  std::array<std::uint8_t, 512> answer{};
  const ssize_t size = recv(handle, answer.data(), answer.size(), MSG_DONTWAIT);
  return size >= 8 && answer[2] == 0x00 && answer[3] == kDiscoveryAcknowledge;
}

}  // namespace

std::vector<DiscoveredCamera> discover_cameras() {
  // Never destroyed, because a detached thread that opens a camera may still search when the process ends.
  struct Known {
    std::mutex one_at_a_time;  // Aravis has one list of devices per process
    std::vector<DiscoveredCamera> answer;
    Timestamp answered_at;
  };
  static Known& known = *std::make_unique<Known>().release();

  const Timestamp now = host_now();
  const std::lock_guard<std::mutex> lock(known.one_at_a_time);
  if (known.answered_at > now) return known.answer;  // another thread searched while this one waited for the lock
  arv_update_device_list();
  known.answer.clear();
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    known.answer.push_back({text_of(arv_get_device_id(i)), text_of(arv_get_device_serial_nbr(i)),
                            text_of(arv_get_device_address(i)), text_of(arv_get_device_physical_id(i)),
                            text_of(arv_get_device_vendor(i)), text_of(arv_get_device_model(i)),
                            text_of(arv_get_device_protocol(i))});
  }
  known.answered_at = host_now();
  return known.answer;
}

std::vector<KeyPairs> find_aravis_cameras() {
  std::vector<KeyPairs> found;
  for (const DiscoveredCamera& each : discover_cameras()) {
    found.push_back({{"bus", each.bus},
                     {"serial", each.serial},
                     {"address", each.address},
                     {"mac", each.mac},
                     {"vendor", each.vendor},
                     {"model", each.model}});
  }
  return found;
}

std::string listed(const std::vector<DiscoveredCamera>& cameras) {
  if (cameras.empty()) return "found none";
  std::string text = "found ";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    text += fmt::format("{}{} ({})", i == 0 ? "" : ", ", cameras[i].serial, cameras[i].address);
  }
  return text;
}

bool gige_camera_answers(const std::string& address, Duration patience) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kGvcpPort);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) return false;
  const Socket socket;
  // Connected, so that a host that refuses the port is reported at once.
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return false;
  for (const Duration wait : {patience / 3, patience - patience / 3}) {
    send(socket.get(), kDiscoveryCommand.data(), kDiscoveryCommand.size(), MSG_NOSIGNAL);
    if (acknowledged(socket.get(), wait)) return true;
  }
  return false;
}

}  // namespace mocap::cameras
