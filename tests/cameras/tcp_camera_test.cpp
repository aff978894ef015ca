#include "cameras/tcp/tcp_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "base/key_check.h"
#include "cameras/open_camera.h"
#include "cameras/tcp/tcp_header.h"
#include "support/loopback_listener.h"

namespace mocap::cameras {
namespace tcp_camera_test {

using testing::HasSubstr;

// A limit, not a wait: each test knows that the bytes were sent. Four times the duration on a loaded machine.
constexpr Duration kPatience = std::chrono::seconds(20);
constexpr Duration kNoPatience = std::chrono::milliseconds(1);

// Fields in the order of the header. The test writes them in its own way, by shifts.
struct Message {
  std::array<char, 4> magic{'M', 'C', 'R', 'F'};
  std::uint16_t version = 1;
  std::uint16_t pixel_format = 1;
  std::uint32_t width = 32;
  std::uint32_t height = 16;
  std::uint64_t number = 7;
  std::int64_t stamp_ns = 1'000'000'000;
  std::uint32_t byte_count = 512;
  std::uint32_t reserved = 0;
  std::vector<std::byte> pixels = std::vector<std::byte>(512, std::byte{9});

  std::vector<std::byte> bytes() const {
    std::vector<std::byte> all;
    const auto put = [&all](std::uint64_t value, int size) {
      for (int i = 0; i < size; ++i) all.push_back(static_cast<std::byte>(value >> (8 * i) & 0xff));
    };
    for (const char each : magic) put(static_cast<unsigned char>(each), 1);
    put(version, 2);
    put(pixel_format, 2);
    put(width, 4);
    put(height, 4);
    put(number, 8);
    put(static_cast<std::uint64_t>(stamp_ns), 8);
    put(byte_count, 4);
    put(reserved, 4);
    all.insert(all.end(), pixels.begin(), pixels.end());
    return all;
  }
};

// A program that listens on a free port of 127.0.0.1 and sends to one camera.
class Sender {
 public:
  Sender() = default;
  ~Sender() { hang_up(); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  int port() const { return listener_.port(); }
  void accept_camera() {
    hang_up();
    connection_ = listener_.accept();
    EXPECT_GE(connection_, 0);
  }
  void send_bytes(std::span<const std::byte> bytes) const {
    EXPECT_EQ(::send(connection_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  void send_message(const Message& message) const { send_bytes(message.bytes()); }
  void hang_up() {
    if (connection_ >= 0) close(std::exchange(connection_, -1));
  }
  void stop_listening() { listener_.close(); }

 private:
  support::LoopbackListener listener_;
  int connection_ = -1;
};

TcpSettings small_images(int port) {
  TcpSettings settings;
  settings.address = "127.0.0.1";
  settings.port = port;
  settings.width_px = 32;
  settings.height_px = 16;
  return settings;
}

class TcpCamera : public testing::Test {
 protected:
  // A camera that is connected to `sender`.
  void connect(const TcpSettings& settings) {
    auto opened = open_camera(CameraId{3}, {"feed", settings}, {.counters = &counters});
    ASSERT_TRUE(opened) << opened.error().message;
    camera = *std::move(opened);
    const Status started = camera->start();
    ASSERT_TRUE(started) << started.error().message;
    sender.accept_camera();
  }
  void connect() { connect(small_images(sender.port())); }

  Error failure_after(const Message& message) {
    connect();
    sender.send_message(message);
    const Result<Frame> frame = camera->next(kPatience);
    return frame ? Error{ErrorCode::InvalidArgument, "a frame came"} : frame.error();
  }

  StreamCounters counters;
  Sender sender;
  std::unique_ptr<Camera> camera;
};

TEST_F(TcpCamera, DeliversTheImagesThatWereSent) {
  connect();
  Message first, second;
  first.pixels[33] = std::byte{200};
  second.number = 9;
  second.stamp_ns += 16'000'000;

  sender.send_message(first);
  const Result<Frame> frame = camera->next(kPatience);
  ASSERT_TRUE(frame) << frame.error().message;
  const std::vector<std::byte> pixels(frame->image.bytes.begin(), frame->image.bytes.end());
  const Timestamp first_exposure = frame->exposed_at;
  sender.send_message(second);
  const Result<Frame> next = camera->next(kPatience);

  EXPECT_EQ(frame->camera, CameraId{3});
  EXPECT_EQ(frame->number, 7U);
  EXPECT_EQ(frame->image.width_px, 32);
  EXPECT_EQ(frame->image.height_px, 16);
  EXPECT_EQ(frame->image.stride_bytes, 32U);
  EXPECT_EQ(pixels, first.pixels);
  ASSERT_TRUE(next) << next.error().message;
  EXPECT_EQ(next->number, 9U);
  EXPECT_GT(next->exposed_at, first_exposure);
  EXPECT_LE(next->exposed_at, next->received_at);
  EXPECT_EQ(counters.completed_frames.load(), 2U);
}

TEST_F(TcpCamera, TakesStampsInUtcAsTheyAre) {
  TcpSettings settings = small_images(sender.port());
  settings.stamps_are_utc = true;
  connect(settings);
  const Timestamp exposed = host_now() - std::chrono::milliseconds(5);
  Message message;
  message.stamp_ns = to_ns(exposed) + utc_minus_host().count();

  sender.send_message(message);
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_TRUE(frame) << frame.error().message;
  // Two readings of UTC minus host clock differ by the time between two clock calls.
  EXPECT_NEAR(to_us(frame->exposed_at - exposed), 0.0, 1000.0);
}

TEST_F(TcpCamera, RefusesAUtcStampOfAnotherYearAndDeliversTheNextImage) {
  TcpSettings settings = small_images(sender.port());
  settings.stamps_are_utc = true;
  connect(settings);
  Message good;
  good.stamp_ns = to_ns(host_now()) + utc_minus_host().count();

  sender.send_message(Message{});
  const Result<Frame> refused = camera->next(kPatience);
  sender.send_message(good);
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
  EXPECT_THAT(refused.error().message, HasSubstr("clock = \"estimated\""));
  EXPECT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(counters.failed_frames.load(), 1U);
}

// An exposure in the future would make the images of all other cameras late.
TEST_F(TcpCamera, RefusesAUtcStampInTheFutureAndDeliversTheNextImage) {
  TcpSettings settings = small_images(sender.port());
  settings.stamps_are_utc = true;
  connect(settings);
  Message fast, good;
  fast.stamp_ns = to_ns(host_now() + std::chrono::seconds(1)) + utc_minus_host().count();

  sender.send_message(fast);
  const Result<Frame> refused = camera->next(kPatience);
  good.stamp_ns = to_ns(host_now()) + utc_minus_host().count();
  sender.send_message(good);
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
  EXPECT_THAT(refused.error().message, HasSubstr("s later than its arrival in UTC, expected at most 0.001 s"));
  EXPECT_THAT(refused.error().message, HasSubstr("synchronise the sender's clock"));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_LE(frame->exposed_at, frame->received_at);
}

// Recordings refuse an image that is not later than the one before.
TEST_F(TcpCamera, RefusesUtcStampsOfBeforeOnANewConnection) {
  TcpSettings settings = small_images(sender.port());
  settings.stamps_are_utc = true;
  connect(settings);
  Message last, again, next;
  last.stamp_ns = to_ns(host_now() - std::chrono::milliseconds(5)) + utc_minus_host().count();
  again.stamp_ns = last.stamp_ns - 500'000'000;
  again.number = 0;
  next.number = 1;

  sender.send_message(last);
  const Result<Frame> before = camera->next(kPatience);
  ASSERT_TRUE(before) << before.error().message;
  const Timestamp exposed_before = before->exposed_at;
  camera->stop();
  ASSERT_TRUE(camera->start());
  sender.accept_camera();
  sender.send_message(again);
  const Result<Frame> refused = camera->next(kPatience);
  next.stamp_ns = to_ns(host_now()) + utc_minus_host().count();
  sender.send_message(next);
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
  EXPECT_THAT(refused.error().message, HasSubstr("s before that of an earlier image, expected a later one"));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_GT(frame->exposed_at, exposed_before);
}

TEST_F(TcpCamera, ReadsTwelveBitsInTwoBytes) {
  TcpSettings settings = small_images(sender.port());
  settings.pixel_format = PixelFormat::Mono12;
  connect(settings);
  Message message;
  message.pixel_format = 3;
  message.byte_count = 1024;
  message.pixels.resize(1024);

  sender.send_message(message);
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->image.format, PixelFormat::Mono12);
  EXPECT_EQ(frame->image.bytes.size(), 1024U);
  EXPECT_EQ(frame->image.stride_bytes, 64U);
}

TEST_F(TcpCamera, WaitsNoLongerThanAskedAndContinuesAHalfSentImage) {
  connect();
  const std::vector<std::byte> bytes = Message{}.bytes();

  const Result<Frame> before_the_header = camera->next(kNoPatience);
  sender.send_bytes(std::span(bytes).first(10));
  const Result<Frame> within_the_header = camera->next(kNoPatience);
  sender.send_bytes(std::span(bytes).subspan(10, 200));
  const Result<Frame> within_the_pixels = camera->next(kNoPatience);
  sender.send_bytes(std::span(bytes).subspan(210));
  const Result<Frame> frame = camera->next(kPatience);

  for (const auto* const result : {&before_the_header, &within_the_header, &within_the_pixels}) {
    ASSERT_FALSE(*result);
    EXPECT_EQ(result->error().code, ErrorCode::Timeout);
    EXPECT_EQ(result->error().message, "");
  }
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->number, 7U);
}

TEST_F(TcpCamera, IsLostIfTheSenderClosesBetweenImages) {
  connect();
  sender.send_message(Message{});
  sender.hang_up();

  EXPECT_TRUE(camera->next(kPatience));
  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(frame.error().message, HasSubstr("the sender closed the connection"));
}

TEST_F(TcpCamera, IsLostIfTheSenderClosesWithinAHeader) {
  connect();
  sender.send_bytes(std::span<const std::byte>(Message{}.bytes()).first(39));
  sender.hang_up();

  const Result<Frame> frame = camera->next(kPatience);

  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(frame.error().message, HasSubstr("within an image"));
}

TEST_F(TcpCamera, ConnectsAgainAfterALoss) {
  connect();
  sender.hang_up();
  EXPECT_EQ(camera->next(kPatience).error().code, ErrorCode::DeviceLost);
  EXPECT_EQ(camera->next(kPatience).error().code, ErrorCode::DeviceLost);

  ASSERT_TRUE(camera->start());
  sender.accept_camera();
  sender.send_message(Message{});

  EXPECT_TRUE(camera->next(kPatience));
}

TEST_F(TcpCamera, DropsTheConnectionAfterAWrongMagic) {
  Message message;
  message.magic = {'G', 'E', 'T', ' '};

  const Error error = failure_after(message);

  EXPECT_EQ(error.code, ErrorCode::DeviceLost);
  EXPECT_THAT(error.message, HasSubstr("camera 'feed': 127.0.0.1:"));
  EXPECT_THAT(error.message, HasSubstr("the magic in the header is"));
}

TEST_F(TcpCamera, RefusesAnotherVersion) {
  Message message;
  message.version = 2;
  EXPECT_THAT(failure_after(message).message, HasSubstr("the version in the header is 2, expected 1"));
}

TEST_F(TcpCamera, RefusesAHugeImage) {
  Message message;
  message.width = message.height = 0xffffffff;
  message.byte_count = 0xffffffff;

  const Error error = failure_after(message);

  EXPECT_EQ(error.code, ErrorCode::DeviceLost);
  EXPECT_THAT(error.message, HasSubstr("the width in the header is 4294967295, expected 32"));
}

TEST_F(TcpCamera, RefusesAByteCountThatDoesNotFitTheSize) {
  Message message;
  message.byte_count = 513;
  EXPECT_THAT(failure_after(message).message,
              HasSubstr("the byte count in the header is 513, expected 512; let the program at this address send "
                        "the format of daemon/cameras/tcp/README.md"));
}

TEST_F(TcpCamera, RefusesANumberThatDoesNotIncreaseAndDeliversTheNextImage) {
  connect();
  Message next;
  next.number = 8;

  sender.send_message(Message{});
  sender.send_message(Message{});
  sender.send_message(next);

  EXPECT_TRUE(camera->next(kPatience));
  const Result<Frame> repeated = camera->next(kPatience);
  ASSERT_FALSE(repeated);
  EXPECT_EQ(repeated.error().code, ErrorCode::Io);
  EXPECT_THAT(repeated.error().message, HasSubstr("image 7 is invalid: its number"));
  EXPECT_TRUE(camera->next(kPatience));
}

TEST_F(TcpCamera, IsLostIfTheSenderBeginsItsNumbersAgainAndDeliversThemOnANewConnection) {
  connect();
  Message late, again;
  late.number = 5000;
  again.number = 0;

  sender.send_message(late);
  ASSERT_TRUE(camera->next(kPatience));
  for (int i = 0; i < 7; ++i) {
    again.number = static_cast<std::uint64_t>(i);
    sender.send_message(again);
    EXPECT_EQ(camera->next(kPatience).error().code, ErrorCode::Io);
  }
  again.number = 7;
  sender.send_message(again);
  const Result<Frame> lost = camera->next(kPatience);

  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(lost.error().message, HasSubstr("its image numbers began again"));
  ASSERT_TRUE(camera->start());
  sender.accept_camera();
  sender.send_message(again);
  EXPECT_TRUE(camera->next(kPatience));
}

TEST_F(TcpCamera, CountsAJumpOfTheSendersClock) {
  connect();
  Message message;
  sender.send_message(message);
  ASSERT_TRUE(camera->next(kPatience));
  ++message.number;
  message.stamp_ns -= 500'000'000;

  sender.send_message(message);
  ASSERT_TRUE(camera->next(kPatience));

  EXPECT_EQ(counters.clock_leaps.load(), 1U);
}

TEST_F(TcpCamera, SurvivesStampsAtTheEndsOfTheirRange) {
  connect();
  const std::int64_t most = std::int64_t{1} << 62;
  int delivered = 0;
  Message message;

  for (const std::int64_t stamp_ns : {INT64_MIN, INT64_MAX, std::int64_t{-1}, std::int64_t{0}, most, std::int64_t{0}}) {
    ++message.number;
    message.stamp_ns = stamp_ns;
    sender.send_message(message);
    const Result<Frame> frame = camera->next(kPatience);
    if (frame) {
      ++delivered;
      EXPECT_LE(frame->exposed_at, frame->received_at);
    } else {
      EXPECT_EQ(frame.error().code, ErrorCode::Io);
    }
  }

  EXPECT_EQ(delivered, 3);
}

TEST_F(TcpCamera, ReportsThatNoSenderListens) {
  sender.stop_listening();
  const auto alone = open_camera(CameraId{0}, {"feed", small_images(sender.port())});
  ASSERT_TRUE(alone);

  const Status started = (*alone)->start();

  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::NotFound);
  EXPECT_THAT(started.error().message, HasSubstr("Connection refused; start the sender"));
  EXPECT_EQ((*alone)->next(kNoPatience).error().code, ErrorCode::DeviceLost);
}

TEST(TcpHeader, OfRandomBytesIsRefused) {
  std::mt19937 random(5);
  std::array<std::byte, kTcpHeader_bytes> bytes{};

  for (int i = 0; i < 10000; ++i) {
    for (std::byte& each : bytes) each = static_cast<std::byte>(random() & 0xff);
    const Result<TcpHeader> header = parse_tcp_header(bytes, small_images(5600));
    ASSERT_FALSE(header);  // the constant fields have 192 bits: no random header fits
    EXPECT_EQ(header.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(TcpHeader, IsRefusedIfAnyBitOfAConstantFieldDiffers) {
  const std::vector<std::byte> good = Message{}.bytes();
  std::array<std::byte, kTcpHeader_bytes> bytes{};

  for (std::size_t bit = 0; bit < 8 * kTcpHeader_bytes; ++bit) {
    std::copy_n(good.begin(), bytes.size(), bytes.begin());
    bytes[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    const bool constant = bit / 8 < 16 || bit / 8 >= 32;
    EXPECT_EQ(parse_tcp_header(bytes, small_images(5600)).has_value(), !constant) << "bit " << bit;
  }
}

TEST(TcpSettings, NeedAnIpv4Address) {
  TcpSettings settings = small_images(5600);
  EXPECT_TRUE(faults_of(settings).empty());
  EXPECT_TRUE(check_keys(settings).empty());

  for (const char* const address : {"", "camera.local", "10.0.0", "::1"}) {
    settings.address = address;
    ASSERT_EQ(faults_of(settings).size(), 1U) << address;
    EXPECT_EQ(faults_of(settings)[0].key, "address");
  }
}

TEST(TcpSettings, OfTwoCamerasDifferInAddressOrPort) {
  const CameraFacts west = facts_of(small_images(5600), "west"), east = facts_of(small_images(5601), "east");

  EXPECT_NE(west.device, east.device);
  ASSERT_TRUE(west.size.has_value());
  EXPECT_EQ(west.size->width_px, 32);
}

}  // namespace tcp_camera_test
}  // namespace mocap::cameras
