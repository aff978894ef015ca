#include "cameras/tcp/tcp_settings.h"

#include <arpa/inet.h>
#include <fmt/format.h>

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, TcpSettings& camera) {
  constexpr KeyRange kSide_px{16, 16384};
  keys.text(
      "address", camera.address,
      {.help = "IPv4 address of the sender", .example = "192.168.10.20", .required = "the IPv4 address of the sender"});
  keys.number("port", camera.port, {1, 65535}, {.help = "TCP port on which the sender listens"});
  keys.number("width_px", camera.width_px, kSide_px, {.help = "images of another size are refused"});
  keys.number("height_px", camera.height_px, kSide_px);
  keys.choice("pixel_format", camera.pixel_format,
              {{"Mono8", PixelFormat::Mono8}, {"Mono10", PixelFormat::Mono10}, {"Mono12", PixelFormat::Mono12}},
              {.help = "Mono10 and Mono12: 16 bits in a pixel, little endian"});
  keys.number("rate_hz", camera.rate_hz, {0.1, 10000}, {.help = "images per second that the sender sends"});
  keys.choice("clock", camera.stamps_are_utc, {{"estimated", false}, {"utc", true}},
              {.help = "conversion of the sender's stamps to host time; estimated: offset and drift from the times of "
                       "arrival; utc: the sender counts nanoseconds of UTC since 1970"});
}

std::vector<KeyFault> faults_of(const TcpSettings& camera) {
  in_addr address{};
  if (inet_pton(AF_INET, camera.address.c_str(), &address) == 1) return {};
  return {{"address", fmt::format("address is '{}', expected an IPv4 address such as 192.168.10.20", camera.address)}};
}

CameraFacts facts_of(const TcpSettings& camera, const std::string& /*camera_name*/) {
  return {.rate_hz = camera.rate_hz,
          .size = ImageSize{camera.width_px, camera.height_px},
          .device = {{"address", fmt::format("{}:{}", camera.address, camera.port)}}};
}

}  // namespace mocap::cameras
