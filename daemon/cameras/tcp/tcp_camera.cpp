#include "cameras/tcp/tcp_camera.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/clock/clock_mapping.h"
#include "cameras/clock/leap_counter.h"
#include "cameras/image_layout.h"
#include "cameras/tcp/tcp_header.h"

namespace mocap::cameras {
namespace {

constexpr int kNone = -1;
// Module interface: start() may wait "some tenths of a second". A host of the local network answers within 10 ms.
constexpr Duration kConnectPatience = std::chrono::milliseconds(300);
// A stamp that lies further behind the time of arrival is not UTC. ExposureClock has the same bound.
constexpr Duration kMaxUtcOffset = std::chrono::seconds(10);
// An image arrives after its exposure, so a stamp of UTC ahead of the arrival is an error of the sender's clock. NTP
// keeps two machines of a local network within 1 ms. One exposure in the future would make the images of all other
// cameras late.
constexpr Duration kMaxAhead = std::chrono::milliseconds(1);
// So many images in a row whose numbers do not increase are no repetitions: the sender began its numbers again.
constexpr int kMaxBehind = 8;
// Year 2116 in UTC. Differences of two stamps from 0 to this one cannot overflow a Duration.
constexpr Duration kMaxStamp{std::int64_t{1} << 62};

// Waits until `socket` is ready for `events` or `end` is reached.
bool wait_for(int socket, short events, Timestamp end) {
  const Duration left = std::max(Duration::zero(), Duration(end - host_now()));
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec limit{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
  pollfd waiting{socket, events, 0};
  return ppoll(&waiting, 1, &limit, nullptr) > 0;
}

class TcpCamera final : public Camera {
 public:
  TcpCamera(CameraId id, std::string name, TcpSettings settings, StreamCounters* counters)
      : id_(id), name_(std::move(name)), settings_(std::move(settings)), counters_(counters) {}
  ~TcpCamera() override { TcpCamera::stop(); }
  TcpCamera(const TcpCamera&) = delete;
  TcpCamera& operator=(const TcpCamera&) = delete;

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override {
    if (socket_ != kNone) close(std::exchange(socket_, kNone));
  }

 private:
  Status connect_to_sender();
  Status receive(Timestamp end);
  Result<Frame> frame_of(const TcpHeader& header, Timestamp received);
  Error lose(const std::string& why);
  Error broken(std::uint64_t number, const std::string& why);
  Error behind(std::uint64_t number);
  void count_image();
  Error error(ErrorCode code, const std::string& what) const {
    return {code, fmt::format("camera '{}': {}:{}: {}", name_, settings_.address, settings_.port, what)};
  }

  CameraId id_;
  std::string name_;
  TcpSettings settings_;
  StreamCounters* counters_;

  int socket_ = kNone;
  std::array<std::byte, kTcpHeader_bytes> header_bytes_{};
  std::vector<std::byte> pixels_;
  std::size_t arrived_bytes_ = 0;    // of the current header and its pixels
  std::optional<TcpHeader> header_;  // of the image that is arriving
  Timestamp first_byte_at_;          // of the same image
  std::optional<std::uint64_t> last_number_;
  int behind_ = 0;  // images in a row whose numbers are not above last_number_
  ClockMapping clock_;
  LeapCounter leaps_;
  Timestamp last_exposed_;  // of all connections: exposures of one camera increase
};

Status TcpCamera::start() {
  stop();
  if (Status connected = connect_to_sender(); !connected) {
    stop();
    return connected;
  }
  pixels_.resize(tcp_image_bytes(settings_));
  arrived_bytes_ = 0;
  header_.reset();
  last_number_.reset();
  behind_ = 0;
  clock_.reset();
  log_info("camera " + name_, fmt::format("started driver=tcp address={} port={} size={}x{}", settings_.address,
                                          settings_.port, settings_.width_px, settings_.height_px));
  return {};
}

Status TcpCamera::connect_to_sender() {
  sockaddr_in sender{};
  sender.sin_family = AF_INET;
  sender.sin_port = htons(static_cast<std::uint16_t>(settings_.port));
  if (inet_pton(AF_INET, settings_.address.c_str(), &sender.sin_addr) != 1) {
    return error(ErrorCode::InvalidArgument, "not an IPv4 address");
  }
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) return error(ErrorCode::Io, fmt::format("cannot create a socket: {}", std::strerror(errno)));
  int reason = connect(socket_, reinterpret_cast<const sockaddr*>(&sender), sizeof sender) == 0 ? 0 : errno;
  if (reason == EINPROGRESS) {
    socklen_t size = sizeof reason;
    if (!wait_for(socket_, POLLOUT, host_now() + kConnectPatience)) {
      reason = ETIMEDOUT;
    } else if (getsockopt(socket_, SOL_SOCKET, SO_ERROR, &reason, &size) != 0) {
      reason = errno;
    }
  }
  if (reason == 0) return {};
  return error(ErrorCode::NotFound, fmt::format("cannot connect: {}; start the sender", std::strerror(reason)));
}

Result<Frame> TcpCamera::next(Duration patience) {
  if (socket_ == kNone) return error(ErrorCode::DeviceLost, "not connected");
  const Timestamp end = host_now() + patience;
  if (Status done = receive(end); !done) return done.error();
  if (!header_) {
    const Result<TcpHeader> parsed = parse_tcp_header(header_bytes_, settings_);
    if (!parsed) return lose(parsed.error().message);
    header_ = *parsed;
  }
  if (Status done = receive(end); !done) return done.error();
  const Timestamp received = host_now();
  arrived_bytes_ = 0;
  return frame_of(*std::exchange(header_, std::nullopt), received);
}

// Reads until the header is complete or, if it has been parsed, until the pixels are.
Status TcpCamera::receive(Timestamp end) {
  const std::size_t wanted = header_ ? kTcpHeader_bytes + pixels_.size() : kTcpHeader_bytes;
  while (arrived_bytes_ < wanted) {
    const std::span<std::byte> rest = arrived_bytes_ < kTcpHeader_bytes
                                          ? std::span<std::byte>(header_bytes_).subspan(arrived_bytes_)
                                          : std::span<std::byte>(pixels_).subspan(arrived_bytes_ - kTcpHeader_bytes);
    const ssize_t size = recv(socket_, rest.data(), rest.size(), 0);
    if (size > 0) {
      if (arrived_bytes_ == 0) first_byte_at_ = host_now();
      arrived_bytes_ += static_cast<std::size_t>(size);
    } else if (size == 0) {
      return lose(arrived_bytes_ == 0 ? "the sender closed the connection"
                                      : "the sender closed the connection within an image");
    } else if (errno != EAGAIN && errno != EINTR) {
      return lose(fmt::format("the connection broke: {}", std::strerror(errno)));
    } else if (!wait_for(socket_, POLLIN, end) && host_now() >= end) {
      return Error{ErrorCode::Timeout, {}};
    }
    // A sender that never pauses cannot keep this call longer than `patience`.
    if (arrived_bytes_ < wanted && host_now() >= end) return Error{ErrorCode::Timeout, {}};
  }
  return {};
}

Result<Frame> TcpCamera::frame_of(const TcpHeader& header, Timestamp received) {
  if (last_number_ && header.frame_number <= *last_number_) return behind(header.frame_number);
  behind_ = 0;
  if (header.stamp < Duration::zero() || header.stamp > kMaxStamp) {
    return broken(header.frame_number, fmt::format("its stamp is {} ns", header.stamp.count()));
  }
  // The mapping uses the arrival of the first byte, because the arrival of the last byte depends on the size of the
  // image.
  Timestamp middle;
  if (settings_.stamps_are_utc) {
    middle = Timestamp{header.stamp - utc_minus_host()};
    const Duration ahead = middle - received;
    if (ahead > kMaxAhead || ahead < -kMaxUtcOffset) {
      return broken(header.frame_number,
                    fmt::format("its stamp is {:.3f} s {} its arrival in UTC, expected at most {:.3f} s; synchronise "
                                "the sender's clock (NTP, PTP) or set clock = \"estimated\"",
                                std::abs(to_s(ahead)), ahead > Duration::zero() ? "later than" : "before",
                                to_s(ahead > Duration::zero() ? kMaxAhead : kMaxUtcOffset)));
    }
    if (middle <= last_exposed_) {
      return broken(header.frame_number,
                    fmt::format("its stamp is {:.6f} s before that of an earlier image, expected a later one",
                                to_s(last_exposed_ - middle)));
    }
  } else {
    middle = clock_.map(header.stamp, first_byte_at_);
  }
  last_number_ = header.frame_number;
  last_exposed_ = std::max(std::min(middle, received), last_exposed_ + Duration{1});
  count_image();
  return Frame{id_,
               header.frame_number,
               last_exposed_,
               received,
               {pixels_, packed_stride_bytes(settings_.pixel_format, settings_.width_px), settings_.width_px,
                settings_.height_px, settings_.pixel_format}};
}

void TcpCamera::count_image() {
  if (counters_ == nullptr) return;
  counters_->completed_frames.fetch_add(1, std::memory_order_relaxed);
  leaps_.count(clock_.leaps(), *counters_);
  counters_->clock_uncertainty_us.store(settings_.stamps_are_utc ? 0.0 : to_us(clock_.uncertainty()),
                                        std::memory_order_relaxed);
  counters_->clock_source.store(settings_.stamps_are_utc ? ClockSource::Camera : ClockSource::Receipts,
                                std::memory_order_relaxed);
}

// An image whose number does not increase.
Error TcpCamera::behind(std::uint64_t number) {
  const Error repeated =
      broken(number, fmt::format("its number is not above that of the image before, {}", *last_number_));
  if (++behind_ < kMaxBehind) return repeated;
  return lose(
      fmt::format("its image numbers began again or stand still: {} images in a row are not above {}, the last "
                  "one is {}",
                  behind_, *last_number_, number));
}

Error TcpCamera::lose(const std::string& why) {
  stop();
  return error(ErrorCode::DeviceLost, why);
}

Error TcpCamera::broken(std::uint64_t number, const std::string& why) {
  if (counters_ != nullptr) counters_->failed_frames.fetch_add(1, std::memory_order_relaxed);
  return error(ErrorCode::Io, fmt::format("image {} is invalid: {}", number, why));
}

}  // namespace

Result<std::unique_ptr<Camera>> open_tcp_camera(CameraId id, const std::string& name, const TcpSettings& settings,
                                                const CameraSurroundings& surroundings) {
  return std::unique_ptr<Camera>(std::make_unique<TcpCamera>(id, name, settings, surroundings.counters));
}

}  // namespace mocap::cameras
