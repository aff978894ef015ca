#include "cameras/aravis/aravis_settings.h"

#include <fmt/format.h>

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, AravisSettings& camera) {
  constexpr KeyRange kSide_px{16, 16384};
  constexpr KeyRange kOffset_px{0, 16384};
  keys.text(
      "serial", camera.serial,
      {.help = "serial number of the camera; exactly one of serial, device_name, address and mac says which camera",
       .example = "DA1234567",
       .example_is_active = true});
  keys.text("device_name", camera.device_name, {.help = "user-defined name in the camera", .example = "north-east"});
  keys.text("address", camera.address, {.help = "IP address", .example = "192.168.10.2"});
  keys.text("mac", camera.mac, {.help = "MAC address of its network card", .example = "00:11:1c:f5:a0:01"});
  keys.one_of("pixel_format", camera.pixel_format,
              {"Mono8", "Mono10", "Mono12", "Mono10p", "Mono12p", "Mono10Packed", "Mono12Packed", "BayerGR8",
               "BayerRG8", "BayerGB8", "BayerBG8"},
              {.help = "p: packed as GenICam; Packed: as GigE Vision; of a Bayer format the green pixels are used"});
  keys.number("x_px", camera.x_px, kOffset_px,
              {.help = "left edge of the region of the sensor; the camera's own value if absent", .example = "0"});
  keys.number("y_px", camera.y_px, kOffset_px, {.help = "top edge", .example = "0"});
  keys.number("width_px", camera.width_px, kSide_px, {.help = "width of the region", .example = "1936"});
  keys.number("height_px", camera.height_px, kSide_px, {.help = "height of the region", .example = "1216"});
  keys.number("rate_hz", camera.rate_hz, {0.1, 10000},
              {.help = "images per second; the camera's own value if absent", .example = "200"});
  keys.number("exposure_us", camera.exposure_us, {1, 1e6},
              {.help = "the camera's own value if absent", .example = "800"});
  keys.number("gain_db", camera.gain_db, {0, 60}, {.help = "the camera's own value if absent", .example = "0"});
  keys.one_of(
      "trigger", camera.trigger, {"free_run", "software", "action", "Line<n>"},
      {.help = "start of each exposure; action: GigE cameras of one rate_hz expose together, with ptp = true to "
               "the accuracy of PTP, otherwise within about 0.1 ms; needs rate_hz"});
  keys.number("packet_size_bytes", camera.packet_size_bytes, {576, 65507},  // least IPv4 datagram to most over UDP
              {.help = "negotiated if absent", .example = "9000"});
  keys.flag("packet_socket", camera.packet_socket,
            {.help = "false on loopback, where a packet socket receives nothing"});
  keys.number("stream_buffers", camera.stream_buffers, {2, 1024}, {.help = "images that may wait for the daemon"});
  keys.number("delivery_us", camera.delivery_us, {0, 1e6},
              {.help = "shortest time from the end of the exposure to the arrival of the first byte; used with "
                       "clock = \"estimated\""});
  keys.one_of("clock", camera.clock, {"estimated", "utc"},
              {.help = "conversion of the camera's stamps to host time; estimated: offset and drift from the times of "
                       "arrival; utc: the camera counts nanoseconds of UTC (PTP)"});
  keys.flag("ptp", camera.ptp, {.help = "true: PTP (IEEE 1588) is enabled in the camera, and its role is waited for"});
  keys.flag(
      "chunks", camera.chunks,
      {.help = "true: start and length of the exposure are read from each image if the camera can write them there"});
  keys.one_of(
      "stamps", camera.stamps, {"start", "middle", "end"},
      {.help = "instant of the exposure that the camera stamps; used with clock = \"utc\" and with exposures that "
               "vary; chunks give the start"});
  keys.pairs(
      "features", camera.features,
      {.help = "other features by their GenICam names, set in this order after all of the above; mocapctl cameras "
               "describe lists them",
       .example = "{ LineSelector = \"Line1\", LineDebouncerTime = 2.0 }"});
}

std::vector<KeyFault> faults_of(const AravisSettings& camera) {
  std::vector<KeyFault> faults;
  const int given = int{!camera.serial.empty()} + int{!camera.device_name.empty()} + int{!camera.address.empty()} +
                    int{!camera.mac.empty()};
  if (given != 1) {
    faults.push_back(
        {"", fmt::format("{} of serial, device_name, address and mac are set, expected exactly one", given)});
  }
  if (camera.trigger == "action" && !camera.rate_hz)
    faults.push_back({"trigger", "trigger = \"action\" needs rate_hz"});
  return faults;
}

CameraFacts facts_of(const AravisSettings& camera, const std::string& /*camera_name*/) {
  CameraFacts facts{.rate_hz = camera.rate_hz, .exposure_us = camera.exposure_us};
  if (camera.width_px && camera.height_px) facts.size = ImageSize{*camera.width_px, *camera.height_px};
  facts.device = {
      {"serial", camera.serial}, {"device_name", camera.device_name}, {"address", camera.address}, {"mac", camera.mac}};
  return facts;
}

}  // namespace mocap::cameras
