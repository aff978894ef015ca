#include "gige_device.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "gige_features.h"

namespace mocap::sim {
namespace {

// Command ids of GVCP. The id of an acknowledge is the id of its command plus 1.
constexpr std::uint16_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080, kWriteRegister = 0x0082,
                        kReadMemory = 0x0084, kWriteMemory = 0x0086, kAction = 0x0100;
constexpr std::uint16_t kAccessDenied = 0x8006, kInvalidAddress = 0x8003;
constexpr std::uint8_t kAnswerWanted = 0x01;
// Bootstrap registers.
constexpr std::uint32_t kMacHigh = 0x0008, kMacLow = 0x000c, kDiscoveryBytes = 0xf8, kCapability = 0x0934,
                        kHeartbeat_ms = 0x0938, kPrivilege = 0x0a00, kStreamPort = 0x0d00, kPacketSize = 0x0d04,
                        kPacketDelay = 0x0d08, kStreamAddress = 0x0d18;
constexpr std::uint32_t kCanResend = 1U << 2, kCanWriteMemory = 1U << 1, kCanAct = 1U << 6, kCanSchedule = 1U << 14;
constexpr std::uint32_t kFireTestPacket = 1U << 31;
constexpr int kLookAtStop_ms = 20;

bool same(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

// Aravis adds address and size in 32 bits, so that a large address passes its own check.
bool is_in_registers(std::uint32_t address, std::size_t size) {
  return address < ARV_FAKE_CAMERA_MEMORY_SIZE && size <= ARV_FAKE_CAMERA_MEMORY_SIZE - address;
}

}  // namespace

GigeDevice::GigeDevice(const Settings& settings)
    : settings_(settings),
      clock_(1e3 * settings.clock_skew_us, 1e-6 * settings.clock_drift_ppm, utc_now_ns()),
      stream_(settings.lost_share, settings.seed) {}

Result<std::unique_ptr<GigeDevice>> GigeDevice::serve(const Settings& settings) {
  std::unique_ptr<GigeDevice> device(new GigeDevice(settings));
  if (const Status opened = device->open(); !opened) return opened.error();
  device->describe();
  device->thread_ = std::jthread([raw = device.get()](const std::stop_token& stop) { raw->run(stop); });
  return device;
}

GigeDevice::~GigeDevice() {
  thread_ = {};  // stop and join the thread before the members are destroyed
  for (const int each : sockets_) {
    if (each >= 0) close(each);
  }
  if (registers_ != nullptr) g_object_unref(registers_);
}

Status GigeDevice::open() {
  in_addr address{};
  const bool is_address = inet_pton(AF_INET, settings_.address.c_str(), &address) == 1;
  if (is_address) sockets_[0] = bound_gvcp_socket(address, false);
  if (sockets_[0] < 0 || !stream_.open(address)) {
    return Error{ErrorCode::Busy,
                 fmt::format("cannot serve at {} (UDP port {}): {}; another camera is simulated there, or no interface "
                             "has this address: try --first-address, or ip addr add {}/8 dev lo",
                             settings_.address, kGvcpPort, is_address ? std::strerror(errno) : "not an IPv4 address",
                             settings_.address)};
  }
  in_addr everybody{};
  everybody.s_addr = htonl(INADDR_BROADCAST);
  sockets_[1] = bound_gvcp_socket(everybody, true);
  in_addr subnet{};
  subnet.s_addr =
      address.s_addr | htonl(0x00ffffff);  // broadcast address of a /8 network: cameras are served on loopback
  sockets_[2] = bound_gvcp_socket(subnet, true);
  return {};
}

void GigeDevice::describe() {
  ArvFakeCamera* const stock = arv_fake_camera_new(settings_.serial.c_str());
  std::size_t size = 0;
  const char* const xml = arv_fake_camera_get_genicam_xml(stock, &size);
  const std::string more = with_more_features(std::string(xml, size));
  g_object_unref(stock);
  std::array<char, 32> name{"/tmp/mocap-sim-XXXXXX"};
  const int file = mkstemp(name.data());
  const bool written = file >= 0 && ::write(file, more.data(), more.size()) == static_cast<ssize_t>(more.size());
  registers_ = arv_fake_camera_new_full(settings_.serial.c_str(), written ? name.data() : nullptr);
  arv_fake_camera_get_genicam_xml(registers_, &description_bytes_);
  if (file >= 0) {
    close(file);
    unlink(name.data());
  }
  GInetAddress* const address = g_inet_address_new_from_string(settings_.address.c_str());
  arv_fake_camera_set_inet_address(registers_, address);
  g_object_unref(address);
  const auto set = [&](std::uint32_t at, double value) {
    arv_fake_camera_write_register(registers_, at, static_cast<std::uint32_t>(value));
  };
  set(ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, settings_.width_px);
  set(ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, settings_.height_px);
  set(ARV_FAKE_CAMERA_REGISTER_WIDTH, settings_.width_px);
  set(ARV_FAKE_CAMERA_REGISTER_HEIGHT, settings_.height_px);
  set(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, 1e6 / settings_.rate_hz);
  set(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, settings_.exposure_us);
  set(kCapability, kCanWriteMemory | kCanAct | kCanSchedule | (settings_.resends ? kCanResend : 0U));
  set(kPtpStatus, kPtpDisabled);
  in_addr own{};
  inet_pton(AF_INET, settings_.address.c_str(), &own);
  set(kMacHigh, 0x0200);  // locally administered
  set(kMacLow, ntohl(own.s_addr));
  set(kTemperature, 41);
}

bool GigeDevice::acquiring() const {
  return read(kPrivilege) != 0 && arv_fake_camera_get_acquisition_status(registers_) != 0;
}

GigeDevice::Trigger GigeDevice::trigger() const {
  if (arv_fake_camera_is_in_software_trigger_mode(registers_)) return Trigger::Software;
  if (read(ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE) == 0) return Trigger::Free;
  return read(ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE) == kTriggeredByAction ? Trigger::Action : Trigger::Line;
}

bool GigeDevice::take_software_trigger() {
  return arv_fake_camera_check_and_acknowledge_software_trigger(registers_) != 0;
}

std::uint32_t GigeDevice::read(std::uint32_t address) const {
  guint32 value = 0;
  arv_fake_camera_read_register(registers_, address, &value);
  return value;
}

std::uint32_t GigeDevice::period_us() const {
  return std::max(1U, read(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US));
}

std::uint32_t GigeDevice::exposure_us() const { return read(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US); }

ServedImage GigeDevice::layout() const {
  ServedImage image;
  image.pixel_format = read(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT);
  image.width = read(ARV_FAKE_CAMERA_REGISTER_WIDTH);
  image.height = read(ARV_FAKE_CAMERA_REGISTER_HEIGHT);
  image.left = read(ARV_FAKE_CAMERA_REGISTER_X_OFFSET);
  image.top = read(ARV_FAKE_CAMERA_REGISTER_Y_OFFSET);
  image.chunks = read(kChunkMode) != 0;
  image.exposure_us = exposure_us();
  return image;
}

std::size_t GigeDevice::payload_bytes() const {
  const ServedImage image = layout();
  const std::size_t bits = (image.pixel_format >> 16) & 0xff;
  return std::size_t{image.width} * image.height * bits / 8;
}

WantedChunks GigeDevice::wanted_chunks() const {
  return {read(kChunkTimestamp) != 0, read(kChunkExposureTime) != 0, read(kChunkFrameId) != 0};
}

void GigeDevice::send(const ServedImage& image) {
  if (image.chunks) {
    stream_.send(image, chunks_behind(image, payload_bytes(), wanted_chunks()), route());
  } else {
    stream_.send(image, {}, route());
  }
}

StreamRoute GigeDevice::route() const {
  StreamRoute route;
  route.to.sin_family = AF_INET;
  route.to.sin_addr.s_addr = htonl(read(kStreamAddress));
  route.to.sin_port = htons(static_cast<std::uint16_t>(read(kStreamPort)));
  route.packet_bytes = read(kPacketSize) & 0xffff;
  route.packet_delay = Duration{read(kPacketDelay)};  // in ticks of the camera clock, 1 ns
  return route;
}

void GigeDevice::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::array<pollfd, 3> waiting{};
    for (std::size_t i = 0; i < waiting.size(); ++i) waiting[i] = {sockets_[i], POLLIN, 0};
    poll(waiting.data(), waiting.size(), kLookAtStop_ms);
    for (const pollfd& each : waiting) {
      if ((each.revents & POLLIN) != 0) answer(each.fd);
    }
    let_go_of_silent_client();
  }
}

void GigeDevice::answer(int socket) {
  std::array<std::uint8_t, kMaxGvcpBytes> packet{};
  const std::optional<GvcpCommand> received = receive_gvcp(socket, packet);
  if (!received) return;
  const GvcpCommand& command = *received;
  if (client_ && same(*client_, command.from)) client_heard_at_ = host_now();
  if (read_command(command) || write_command(command)) follow_control(command);
}

bool GigeDevice::read_command(const GvcpCommand& command) {
  const auto& data = command.data;
  std::array<std::uint8_t, 580> payload{};
  if (command.command == kDiscovery) {
    arv_fake_camera_read_memory(registers_, 0, kDiscoveryBytes, payload.data());
    command.acknowledge(std::span(payload).first(kDiscoveryBytes));
  } else if (command.command == kReadRegister && data.size() >= 4) {
    if (!can_read(get32(data.data()))) return command.acknowledge({}, kInvalidAddress), true;
    put32(payload.data(), read(get32(data.data())));
    command.acknowledge(std::span(payload).first(4));
  } else if (command.command == kReadMemory && data.size() >= 8) {
    if (!can_read(get32(data.data()))) return command.acknowledge({}, kInvalidAddress), true;
    const std::uint32_t count = std::min<std::uint32_t>(get16(&data[6]), 512);
    put32(payload.data(), get32(data.data()));
    arv_fake_camera_read_memory(registers_, get32(data.data()), count, &payload[4]);
    command.acknowledge(std::span(payload).first(4 + count));
  } else if (command.command == kResend && data.size() >= 12) {
    const std::uint32_t first = get32(&data[4]) & 0xffffff, last = get32(&data[8]) & 0xffffff;
    if (settings_.resends) stream_.resend(get16(&data[2]), first, last);
  } else if (command.command == kAction) {
    take_action(command);
  } else {
    return false;
  }
  return true;
}

bool GigeDevice::write_command(const GvcpCommand& command) {
  const auto& data = command.data;
  const bool one = command.command == kWriteRegister && data.size() >= 8;
  if (!one && !(command.command == kWriteMemory && data.size() > 4)) return false;
  if (!may_write(command.from)) {
    refuse(command);
    return false;
  }
  if (!is_in_registers(get32(data.data()), one ? 4 : data.size() - 4)) {
    command.acknowledge({}, kInvalidAddress);
    return true;
  }
  std::array<std::uint8_t, 4> payload{};
  if (one) {
    arv_fake_camera_write_register(registers_, get32(data.data()), get32(&data[4]));
    written(get32(data.data()), get32(&data[4]));
    put32(payload.data(), 1);
  } else {
    std::array<std::uint8_t, 1500> bytes{};
    std::copy(data.begin() + 4, data.end(), bytes.begin());
    arv_fake_camera_write_memory(registers_, get32(data.data()), static_cast<std::uint32_t>(data.size() - 4),
                                 bytes.data());
    put32(payload.data(), get32(data.data()));
  }
  command.acknowledge(payload);
  return true;
}

// Accepts an action command while a client controls the camera. Any host that has the keys may send the command.
void GigeDevice::take_action(const GvcpCommand& command) {
  if (!client_) return;
  const ActionKeys keys{read(kActionDeviceKey), read(kActionGroupKey), read(kActionGroupMask)};
  const auto answer = actions_.take(command.flags, command.data, keys, clock_, command.arrived_utc_ns);
  if (answer == GigeActions::Answer::NotForUs || (command.flags & kAnswerWanted) == 0) return;
  command.acknowledge({}, static_cast<std::uint16_t>(answer));
}

void GigeDevice::lose_ptp() {
  clock_.run_free();
  arv_fake_camera_write_register(registers_, kPtpStatus, kPtpListening);
}

void GigeDevice::written(std::uint32_t address, std::uint32_t value) {
  if (address == ARV_FAKE_CAMERA_REGISTER_ACQUISITION && value != 0) {
    actions_.clear();
    ++acquisitions_;
  }
  const auto set = [&](std::uint32_t at, std::uint32_t to) { arv_fake_camera_write_register(registers_, at, to); };
  if (address == kPacketSize && (value & kFireTestPacket) != 0) {
    stream_.send_test_packet(route());
    set(kPacketSize, value & ~kFireTestPacket);
  }
  if (address == kPtpEnable) {
    set(kPtpStatus, value != 0 ? kPtpSlave : kPtpDisabled);
    value != 0 ? clock_.follow_utc(settings_.ptp_offset_ns) : clock_.run_free();
  }
  if (address == kTimestampLatch) {
    const std::uint64_t now_ns = clock_.stamp_ns(utc_now_ns());
    set(kTimestampHigh, static_cast<std::uint32_t>(now_ns >> 32));
    set(kTimestampLow, static_cast<std::uint32_t>(now_ns));
  }
  if (address >= kChunkMode && address <= kChunkFrameId) {
    set(kChunkBytes, read(kChunkMode) != 0 ? static_cast<std::uint32_t>(chunk_bytes(wanted_chunks())) : 0U);
  }
  if (address == kPtpLatch) set(kPtpOffset_ns, static_cast<std::uint32_t>(settings_.ptp_offset_ns));
}

// Aravis reads beyond the end of the description, if a read begins there; it fills up a read that only ends there.
bool GigeDevice::can_read(std::uint32_t address) const {
  return address < ARV_FAKE_CAMERA_MEMORY_SIZE + description_bytes_;
}

void GigeDevice::refuse(const GvcpCommand& command) { command.acknowledge({}, kAccessDenied); }

bool GigeDevice::may_write(const sockaddr_in& from) const { return !client_ || same(*client_, from); }

void GigeDevice::follow_control(const GvcpCommand& command) {
  const bool controlled = read(kPrivilege) != 0;
  if (!client_ && controlled) {
    client_ = command.from;
    client_heard_at_ = host_now();
  } else if (client_ && !controlled) {
    client_.reset();
  }
}

void GigeDevice::let_go_of_silent_client() {
  if (!client_ || host_now() - client_heard_at_ < std::chrono::milliseconds(read(kHeartbeat_ms))) return;
  client_.reset();
  arv_fake_camera_write_register(registers_, kPrivilege, 0);
  arv_fake_camera_write_register(registers_, ARV_FAKE_CAMERA_REGISTER_ACQUISITION, 0);
}

}  // namespace mocap::sim
