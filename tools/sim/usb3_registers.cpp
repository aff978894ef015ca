#include "usb3_registers.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "usb3_addresses.h"

namespace mocap::sim {
namespace {

constexpr std::uint32_t kMagic = 0x43563355;  // "U3VC"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::uint16_t kWantsAnswer = 0x4000;
constexpr std::uint16_t kReadMemory = 0x0800, kWriteMemory = 0x0802;
// Status of an acknowledge (GenCP 1.3, section 4.3).
constexpr std::uint16_t kDone = 0x0000, kNotKnown = 0x8001, kWrongParameter = 0x8002, kNoSuchAddress = 0x8003,
                        kReadOnly = 0x8004;

template <class T>
T at(std::span<const std::byte> bytes, std::size_t place) {
  T value{};
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}
template <class T>
void set(std::span<std::byte> bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, sizeof value);
}

}  // namespace

template <class T>
T Usb3Registers::get(std::size_t address) const {
  return at<T>(memory_, address);
}
template <class T>
void Usb3Registers::put(std::size_t address, T value) {
  set(std::span(memory_), address, value);
}

Usb3Registers::Usb3Registers(const Settings& settings) {
  const std::string xml = usb3_description(settings.width_px, settings.height_px);
  memory_.resize(usb3::kDescriptionAt + xml.size());
  std::memcpy(memory_.data() + usb3::kDescriptionAt, xml.data(), xml.size());
  put_bootstrap(settings, xml.size());
  for (const std::size_t address : {usb3::kWidth, usb3::kSensorWidth}) put(address, settings.width_px);
  for (const std::size_t address : {usb3::kHeight, usb3::kSensorHeight}) put(address, settings.height_px);
  put(usb3::kPixelFormat, std::uint32_t{0x01080001});
  put(usb3::kRate_hz, settings.rate_hz);
  put(usb3::kExposure_us, settings.exposure_us);
  put(usb3::kTemperature, std::uint32_t{41});
  follow(usb3::kWidth);
}

void Usb3Registers::put_text(std::size_t address, const std::string& text) {
  std::memcpy(memory_.data() + address, text.data(), std::min<std::size_t>(text.size(), 63));
}

void Usb3Registers::put_bootstrap(const Settings& settings, std::size_t xml_bytes) {
  put(usb3::kVersion, std::uint32_t{0x0001'0003});
  put_text(usb3::kManufacturer, "mocap");
  put_text(usb3::kModel, "Usb3");
  put_text(usb3::kFamily, "mocap");
  put_text(usb3::kDeviceVersion, "1");
  put_text(usb3::kSerial, settings.serial);
  put_text(usb3::kUserName, settings.serial);
  put(usb3::kCapability, std::uint64_t{1});  // supports a user-defined name
  put(usb3::kResponseTime_ms, std::uint32_t{200});
  put(usb3::kManifest, std::uint64_t{usb3::kManifestAt});
  put(usb3::kSbrm, std::uint64_t{usb3::kSbrmAt});
  put(usb3::kTimestampIncrement_ns, std::uint64_t{1});
  put(usb3::kU3vVersion, std::uint32_t{0x0001'0000});
  put(usb3::kMostCommand, std::uint32_t{kMostCommand_bytes});
  put(usb3::kMostAcknowledge, std::uint32_t{kMostAcknowledge_bytes});
  put(usb3::kStreamChannels, std::uint32_t{1});
  put(usb3::kSirm, std::uint64_t{usb3::kSirmAt});
  put(usb3::kSirmBytes, std::uint32_t{usb3::kSirmEnd - usb3::kSirmAt});
  put(usb3::kSpeed, std::uint32_t{8});  // SuperSpeed
  put(usb3::kNeedsLeader, std::uint32_t{usb3::kLeaderBytes});
  put(usb3::kNeedsTrailer, std::uint32_t{usb3::kTrailerBytes});
  // The manifest: one uncompressed file, schema version 1.1.
  put(usb3::kManifestAt, std::uint64_t{1});
  put(usb3::kManifestAt + 8, std::uint32_t{0x0100'0000});
  put(usb3::kManifestAt + 12, std::uint32_t{0x0101'0000});
  put(usb3::kManifestAt + 16, std::uint64_t{usb3::kDescriptionAt});
  put(usb3::kManifestAt + 24, std::uint64_t{xml_bytes});
}

std::size_t Usb3Registers::answer(std::span<const std::byte> command, std::span<std::byte> room) {
  if (command.size() < kHeaderBytes || at<std::uint32_t>(command, 0) != kMagic) return 0;
  const auto flags = at<std::uint16_t>(command, 4);
  const auto what = at<std::uint16_t>(command, 6);
  const std::span<const std::byte> data = command.subspan(kHeaderBytes);
  const std::span<std::byte> payload = room.subspan(kHeaderBytes);
  std::uint16_t status = kNotKnown;
  std::size_t length = 0;
  const std::lock_guard lock(mutex_);
  if (what == kReadMemory && data.size() >= 12) {
    const std::size_t count = at<std::uint16_t>(data, 10);
    status = count <= payload.size() ? read(at<std::uint64_t>(data, 0), payload.first(count)) : kWrongParameter;
    if (status == kDone) length = count;
  } else if (what == kWriteMemory && data.size() > 8) {
    status = write(at<std::uint64_t>(data, 0), data.subspan(8));
    set(payload, 0, std::uint16_t{0});
    set(payload, 2, static_cast<std::uint16_t>(status == kDone ? data.size() - 8 : 0));
    length = 4;
  }
  set(room, 0, kMagic);
  set(room, 4, status);
  set(room, 6, static_cast<std::uint16_t>(what + 1));
  set(room, 8, static_cast<std::uint16_t>(length));
  set(room, 10, at<std::uint16_t>(command, 10));
  return (flags & kWantsAnswer) != 0 ? kHeaderBytes + length : 0;
}

std::uint16_t Usb3Registers::read(std::uint64_t address, std::span<std::byte> into) const {
  if (address > memory_.size() || into.size() > memory_.size() - address) return kNoSuchAddress;
  std::memcpy(into.data(), memory_.data() + address, into.size());
  return kDone;
}

std::uint16_t Usb3Registers::write(std::uint64_t address, std::span<const std::byte> data) {
  if (address > memory_.size() || data.size() > memory_.size() - address) return kNoSuchAddress;
  const auto inside = [&](std::size_t begin, std::size_t end) {
    return address >= begin && address + data.size() <= end;
  };
  const auto touches = [&](std::size_t begin, std::size_t end) {
    return address < end && address + data.size() > begin;
  };
  const bool ours = inside(usb3::kFeatures, usb3::kFeaturesEnd) && !touches(usb3::kSensorWidth, usb3::kPixelFormat) &&
                    !touches(usb3::kPayload, usb3::kAcquisitionMode) && !touches(usb3::kAcquiring, usb3::kRate_hz);
  if (!ours && !inside(usb3::kStreamEnable, usb3::kSirmEnd)) return kReadOnly;
  std::array<std::byte, kMostCommand_bytes> before{};
  if (data.size() > before.size()) return kWrongParameter;
  std::memcpy(before.data(), memory_.data() + address, data.size());
  std::memcpy(memory_.data() + address, data.data(), data.size());
  if (!is_valid()) {
    std::memcpy(memory_.data() + address, before.data(), data.size());
    return kWrongParameter;
  }
  follow(address);
  return kDone;
}

// Checks the values that a client may write. Offsets are not checked here, because a client sets size and offset one
// after the other; the sender clips the region.
bool Usb3Registers::is_valid() const {
  const auto width = get<std::uint32_t>(usb3::kWidth), height = get<std::uint32_t>(usb3::kHeight);
  const double rate_hz = get<double>(usb3::kRate_hz), exposure_us = get<double>(usb3::kExposure_us);
  return width >= 16 && width <= get<std::uint32_t>(usb3::kSensorWidth) && height >= 16 &&
         height <= get<std::uint32_t>(usb3::kSensorHeight) && rate_hz >= 1.0 && rate_hz <= 1000.0 &&
         exposure_us >= 10.0 && exposure_us <= 1e5 && get<double>(usb3::kGain_db) >= 0.0 &&
         get<double>(usb3::kGain_db) <= 24.0;
}

// Side effects of a register write.
void Usb3Registers::follow(std::uint64_t address) {
  if (address == usb3::kStart) put(usb3::kAcquiring, std::uint32_t{1});
  if (address == usb3::kStop) put(usb3::kAcquiring, std::uint32_t{0});
  if (address == usb3::kTriggerSoftware) triggered_ = true;
  put(usb3::kPayload, static_cast<std::uint32_t>(payload_bytes()));
  put(usb3::kNeedsPayload, payload_bytes());
}

// In PFNC, bits 16 to 23 contain the number of bits per pixel.
std::uint64_t Usb3Registers::payload_bytes() const {
  const std::uint64_t bits_a_pixel = (get<std::uint32_t>(usb3::kPixelFormat) >> 16) & 0xff;
  const std::uint64_t pixels = std::uint64_t{get<std::uint32_t>(usb3::kWidth)} * get<std::uint32_t>(usb3::kHeight);
  return (pixels * bits_a_pixel + 7) / 8;
}

bool Usb3Registers::streaming() const {
  const std::lock_guard lock(mutex_);
  return get<std::uint32_t>(usb3::kAcquiring) != 0 && (get<std::uint32_t>(usb3::kStreamEnable) & 1) != 0;
}

void Usb3Registers::unplugged() {
  const std::lock_guard lock(mutex_);
  put(usb3::kAcquiring, std::uint32_t{0});
  put(usb3::kStreamEnable, std::uint32_t{0});
}

Usb3Registers::Layout Usb3Registers::layout() const {
  const std::lock_guard lock(mutex_);
  return {get<std::uint32_t>(usb3::kPixelFormat), get<std::uint32_t>(usb3::kWidth), get<std::uint32_t>(usb3::kHeight),
          get<std::uint32_t>(usb3::kLeft),        get<std::uint32_t>(usb3::kTop),   payload_bytes()};
}

double Usb3Registers::rate_hz() const {
  const std::lock_guard lock(mutex_);
  return get<double>(usb3::kRate_hz);
}

double Usb3Registers::exposure_us() const {
  const std::lock_guard lock(mutex_);
  return get<double>(usb3::kExposure_us);
}

Usb3Registers::Trigger Usb3Registers::trigger() const {
  const std::lock_guard lock(mutex_);
  if (get<std::uint32_t>(usb3::kTriggerMode) == 0) return Trigger::Free;
  return get<std::uint32_t>(usb3::kTriggerSource) == 0 ? Trigger::Software : Trigger::Line;
}

bool Usb3Registers::take_software_trigger() {
  const std::lock_guard lock(mutex_);
  return std::exchange(triggered_, false);
}

}  // namespace mocap::sim
