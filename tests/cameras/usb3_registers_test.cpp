// The registers of the simulated USB3 Vision camera, by commands of GenCP 1.3.
#include "usb3_registers.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "usb3_addresses.h"

namespace mocap::sim {
namespace usb3_registers_test {

constexpr std::uint32_t kMagic = 0x43563355;
constexpr std::uint16_t kAnswered = 0x4000, kRead = 0x0800, kWrite = 0x0802;
constexpr std::uint16_t kDone = 0x0000, kNotKnown = 0x8001, kWrongParameter = 0x8002, kNoSuchAddress = 0x8003,
                        kReadOnly = 0x8004;

struct Answer {
  std::uint16_t status = 0, command = 0, request = 0;
  std::vector<std::byte> data;
};

template <class T>
void append(std::vector<std::byte>& to, T value) {
  const auto* raw = reinterpret_cast<const std::byte*>(&value);
  to.insert(to.end(), raw, raw + sizeof value);
}

class Usb3Camera : public testing::Test {
 protected:
  std::optional<Answer> ask(std::uint16_t command, const std::vector<std::byte>& data,
                            std::uint16_t flags = kAnswered) {
    std::vector<std::byte> packet;
    append(packet, kMagic);
    append(packet, flags);
    append(packet, command);
    append(packet, static_cast<std::uint16_t>(data.size()));
    append(packet, ++request_);
    packet.insert(packet.end(), data.begin(), data.end());
    std::vector<std::byte> room(Usb3Registers::kMostAcknowledge_bytes);
    const std::size_t size = registers_.answer(packet, room);
    if (size < 12) return std::nullopt;
    Answer answer;
    std::memcpy(&answer.status, &room[4], 2);
    std::memcpy(&answer.command, &room[6], 2);
    std::memcpy(&answer.request, &room[10], 2);
    answer.data.assign(room.begin() + 12, room.begin() + static_cast<std::ptrdiff_t>(size));
    return answer;
  }
  std::optional<Answer> read(std::uint64_t address, std::uint16_t bytes) {
    std::vector<std::byte> data;
    append(data, address);
    append(data, std::uint16_t{0});
    append(data, bytes);
    return ask(kRead, data);
  }
  template <class T>
  std::uint16_t write(std::uint64_t address, T value) {
    std::vector<std::byte> data;
    append(data, address);
    append(data, value);
    const auto answer = ask(kWrite, data);
    return answer ? answer->status : std::uint16_t{0xffff};
  }
  template <class T>
  T value_at(std::uint64_t address) {
    const auto answer = read(address, sizeof(T));
    T value{};
    if (answer && answer->data.size() == sizeof value) std::memcpy(&value, answer->data.data(), sizeof value);
    return value;
  }

  Usb3Registers registers_{{.serial = "U3001", .width_px = 320, .height_px = 240}};
  std::uint16_t request_ = 0;
};

TEST_F(Usb3Camera, LeadsFromTheBootstrapRegistersToItsDescription) {
  const auto serial = read(usb3::kSerial, 64);
  ASSERT_TRUE(serial);
  EXPECT_EQ(serial->status, kDone);
  EXPECT_EQ(serial->command, kRead + 1);
  EXPECT_EQ(serial->request, request_);
  EXPECT_STREQ(reinterpret_cast<const char*>(serial->data.data()), "U3001");

  const auto manifest = value_at<std::uint64_t>(usb3::kManifest);
  EXPECT_EQ(value_at<std::uint64_t>(manifest), 1U);
  const auto address = value_at<std::uint64_t>(manifest + 16), bytes = value_at<std::uint64_t>(manifest + 24);
  std::string xml;
  while (xml.size() < bytes) {
    const auto part =
        read(address + xml.size(), static_cast<std::uint16_t>(std::min<std::uint64_t>(1000, bytes - xml.size())));
    ASSERT_TRUE(part && part->status == kDone);
    xml.append(reinterpret_cast<const char*>(part->data.data()), part->data.size());
  }
  EXPECT_TRUE(xml.starts_with("<?xml"));
  EXPECT_NE(xml.find("</RegisterDescription>"), std::string::npos);
}

TEST_F(Usb3Camera, ReportsTheImageSizeOfTheRegionAndFormatThatWereSet) {
  EXPECT_EQ(value_at<std::uint32_t>(usb3::kPayload), 320U * 240U);
  EXPECT_EQ(write(usb3::kWidth, std::uint32_t{160}), kDone);
  EXPECT_EQ(write(usb3::kPixelFormat, std::uint32_t{0x010a0046}), kDone);  // Mono10p

  EXPECT_EQ(value_at<std::uint32_t>(usb3::kPayload), 160U * 240U * 10U / 8U);
  EXPECT_EQ(value_at<std::uint64_t>(usb3::kNeedsPayload), 160U * 240U * 10U / 8U);
  EXPECT_EQ(registers_.layout().width_px, 160U);
}

TEST_F(Usb3Camera, RefusesInvalidValuesAndKeepsTheOldOnes) {
  EXPECT_EQ(write(usb3::kWidth, std::uint32_t{321}), kWrongParameter);
  EXPECT_EQ(write(usb3::kRate_hz, std::numeric_limits<double>::quiet_NaN()), kWrongParameter);
  EXPECT_EQ(write(usb3::kExposure_us, 1e6), kWrongParameter);
  EXPECT_EQ(write(usb3::kSerial, std::uint32_t{0}), kReadOnly);
  EXPECT_EQ(write(usb3::kSensorWidth, std::uint32_t{4096}), kReadOnly);
  EXPECT_EQ(write(usb3::kTop, std::uint64_t{0x1000'0000'0000}), kReadOnly) << "into the sensor's width";
  EXPECT_EQ(write(usb3::kAcquiring, std::uint32_t{1}), kReadOnly);
  EXPECT_EQ(write(std::uint64_t{1} << 40, std::uint32_t{0}), kNoSuchAddress);
  EXPECT_EQ(write(std::numeric_limits<std::uint64_t>::max() - 2, std::uint32_t{0}), kNoSuchAddress);
  EXPECT_EQ(read(std::numeric_limits<std::uint64_t>::max() - 2, 4)->status, kNoSuchAddress);
  EXPECT_EQ(ask(0x0900, {})->status, kNotKnown);
  EXPECT_EQ(read(0, 64000)->status, kWrongParameter);

  EXPECT_EQ(value_at<std::uint32_t>(usb3::kWidth), 320U);
  EXPECT_EQ(value_at<std::uint32_t>(usb3::kSensorWidth), 320U);
  EXPECT_EQ(registers_.rate_hz(), 60.0);
  EXPECT_EQ(registers_.exposure_us(), 500.0);
}

TEST_F(Usb3Camera, StreamsWhenBothTheChannelAndTheAcquisitionAreOnUntilItIsUnplugged) {
  EXPECT_EQ(write(usb3::kStart, std::uint32_t{1}), kDone);
  EXPECT_FALSE(registers_.streaming());
  EXPECT_EQ(write(usb3::kStreamEnable, std::uint32_t{1}), kDone);
  EXPECT_TRUE(registers_.streaming());
  EXPECT_EQ(write(usb3::kStop, std::uint32_t{1}), kDone);
  EXPECT_FALSE(registers_.streaming());
  EXPECT_EQ(write(usb3::kStart, std::uint32_t{1}), kDone);
  EXPECT_EQ(write(usb3::kWidth, std::uint32_t{160}), kDone);

  registers_.unplugged();

  EXPECT_FALSE(registers_.streaming());
  EXPECT_EQ(registers_.layout().width_px, 160U);
}

TEST_F(Usb3Camera, DeliversOneImageForEachSoftwareTrigger) {
  EXPECT_EQ(registers_.trigger(), Usb3Registers::Trigger::Free);
  EXPECT_EQ(write(usb3::kTriggerMode, std::uint32_t{1}), kDone);
  EXPECT_EQ(registers_.trigger(), Usb3Registers::Trigger::Software);

  EXPECT_EQ(write(usb3::kTriggerSoftware, std::uint32_t{1}), kDone);

  EXPECT_TRUE(registers_.take_software_trigger());
  EXPECT_FALSE(registers_.take_software_trigger());
}

TEST_F(Usb3Camera, DoesNotAnswerInvalidCommandsAndCommandsWithoutAcknowledgement) {
  std::array<std::byte, 64> room{};
  EXPECT_EQ(registers_.answer({}, room), 0U);
  EXPECT_EQ(registers_.answer(std::vector<std::byte>(40, std::byte{0x55}), room), 0U);

  std::vector<std::byte> data;
  append(data, std::uint64_t{usb3::kWidth});
  append(data, std::uint32_t{100});
  EXPECT_FALSE(ask(kWrite, data, 0));
  EXPECT_EQ(registers_.layout().width_px, 100U) << "and does it";
}

}  // namespace usb3_registers_test
}  // namespace mocap::sim
