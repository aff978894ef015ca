#include "cameras/aravis/action_trigger.h"

#include <endian.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>

#include "cameras/clock/exposure_clock.h"

namespace mocap::cameras {
namespace {

constexpr std::uint16_t kPort = 3956;
constexpr std::uint8_t kKey = 0x42, kScheduled = 0x80, kAnswerWanted = 0x01;
constexpr std::uint16_t kActionCommand = 0x0100, kActionAcknowledge = 0x0101;
constexpr std::uint16_t kNoReferenceTime = 0x8013;
// Cameras queue about 10 scheduled actions. 0.1 s is longer than the delay of a camera thread on a busy machine. Design
// values, see decisions/0011.
constexpr int kMostAhead = 8;
constexpr Duration kAhead = std::chrono::milliseconds(100);
// Shortest time from a scheduled command to its exposure, for a slow network and a slow camera. Design value.
constexpr Duration kLeastAhead = std::chrono::milliseconds(2);
// Largest error of set_clock(). Design value. A PTP master distributes UTC, or TAI as the standard (IEEE 1588) says: a
// camera clock that differs by more than kNear from both has another time scale.
constexpr Duration kNear = std::chrono::milliseconds(50);
constexpr int kProbes = 4, kAnswerPatience_ms = 250;

template <class T>
void put(std::uint8_t* at, T net) {
  std::memcpy(at, &net, sizeof net);
}

std::uint16_t get16(const std::uint8_t* at) { return static_cast<std::uint16_t>(at[0] << 8 | at[1]); }

sockaddr_in name_of(in_addr address, std::uint16_t port) {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr = address;
  name.sin_port = htons(port);
  return name;
}

}  // namespace

Result<std::unique_ptr<ActionTrigger>> ActionTrigger::open(in_addr host, in_addr camera, Duration period) {
  const int handle = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_in from = name_of(host, 0), to = name_of(camera, kPort);
  const bool open = handle >= 0 && bind(handle, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0 &&
                    connect(handle, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (open) return std::unique_ptr<ActionTrigger>(new ActionTrigger(handle, period));
  const int reason = errno;
  if (handle >= 0) close(handle);
  return Error{ErrorCode::Io, fmt::format("no socket for action commands: {}", std::strerror(reason))};
}

ActionTrigger::~ActionTrigger() { close(socket_); }

void ActionTrigger::send(std::uint8_t flags, Duration at) {
  const bool scheduled = (flags & kScheduled) != 0;
  std::array<std::uint8_t, 28> packet{kKey, flags};
  const std::size_t size = scheduled ? 28 : 20;
  if (++request_ == 0) ++request_;  // 0 is not a valid request id
  put(&packet[2], htobe16(kActionCommand));
  put(&packet[4], htobe16(static_cast<std::uint16_t>(size - 8)));
  put(&packet[6], htobe16(request_));
  put(&packet[8], htobe32(kActionDeviceKey));
  put(&packet[12], htobe32(kActionGroupKey));
  put(&packet[16], htobe32(kActionGroupMask));
  if (scheduled) {
    put(&packet[20], htobe64(static_cast<std::uint64_t>(at.count())));
    commands_[request_ % commands_.size()] = {request_, at};
  }
  // A failed send loses one image, as a lost packet does.
  [[maybe_unused]] const ssize_t sent = ::send(socket_, packet.data(), size, MSG_NOSIGNAL);
}

Status ActionTrigger::probe(Timestamp now) {
  for (int i = 0; i < kProbes; ++i) {
    send(kScheduled | kAnswerWanted, now.time_since_epoch() + camera_minus_host_ + kAhead);
    pollfd waiting{socket_, POLLIN, 0};
    std::array<std::uint8_t, 64> answer{};
    if (poll(&waiting, 1, kAnswerPatience_ms) <= 0) continue;
    if (recv(socket_, answer.data(), answer.size(), 0) < 8 || get16(&answer[2]) != kActionAcknowledge) continue;
    const std::uint16_t status = get16(&answer[0]);
    if (status < 0x8000) return {};
    return Error{
        ErrorCode::Unsupported,
        fmt::format("trigger = \"action\": the camera refuses scheduled action commands ({}); set ptp = false "
                    "for commands at exposure time",
                    status == kNoReferenceTime ? "it keeps no PTP time" : fmt::format("status {:#06x}", status))};
  }
  return {};
}

void ActionTrigger::read_clock(const ImageInstants& image) {
  if (image.first_byte < image.received) set_clock(image.stamp + image.exposure - image.first_byte.time_since_epoch());
}

// Sets the next exposure to the first multiple of the period after `clock`.
void ActionTrigger::skip_to(Duration clock) { next_ = (clock / period_ + 1) * period_; }

// Reads acknowledgements. A camera that lost its PTP master refuses a scheduled command and all later ones; the next
// exposure is then the first refused one.
void ActionTrigger::take_answers() {
  std::array<std::uint8_t, 64> answer{};
  for (ssize_t size; (size = recv(socket_, answer.data(), answer.size(), MSG_DONTWAIT)) >= 0;) {
    if (size < 8 || get16(&answer[2]) != kActionAcknowledge || get16(&answer[0]) != kNoReferenceTime) continue;
    const Command& command = commands_[get16(&answer[6]) % commands_.size()];
    if (command.request != get16(&answer[6])) continue;
    next_ = std::min(next_, command.at);
    refused_ = true;
  }
}

// Estimates the offset of the common clock from UTC. The camera's clock was read some milliseconds late; an offset near
// 0 or near TAI - UTC is taken as exactly that.
void ActionTrigger::learn_common_clock(Duration utc_minus_host) {
  const Duration ahead_of_utc = camera_minus_host_ - utc_minus_host;
  common_minus_utc_ = ahead_of_utc;
  for (const Duration usual : {Duration::zero(), kTaiMinusUtc}) {
    if (std::chrono::abs(ahead_of_utc - usual) < kNear) common_minus_utc_ = usual;
  }
}

void ActionTrigger::send_due(Timestamp now, Duration utc_minus_host, bool ahead) {
  take_answers();
  if (!ahead) refused_ = false;
  ahead = ahead && !refused_;
  if (ahead && (!begun_ || !ahead_)) learn_common_clock(utc_minus_host);
  const Duration clock_minus_host = ahead ? camera_minus_host_ : utc_minus_host + common_minus_utc_;
  const Duration clock = now.time_since_epoch() + clock_minus_host;
  const Duration horizon = ahead ? std::min(kAhead, kMostAhead * period_) : Duration::zero();
  const Duration first = clock + (ahead ? kLeastAhead : Duration::zero());
  // A change between scheduled and immediate commands continues with the first exposure that was not commanded yet,
  // unless the clock jumped: next_ is at most kAhead + period_ ahead of a clock without errors.
  const bool leapt = next_ - clock > kAhead + period_ + kNear;
  const bool missed = ahead ? next_ < first : clock - next_ > period_ / 2;
  if (!begun_ || leapt || missed) skip_to(first);
  begun_ = true;
  ahead_ = ahead;
  for (; next_ <= clock + horizon; next_ += period_) send(ahead ? kScheduled | kAnswerWanted : 0, next_);
  next_due_ = Timestamp{next_ - horizon - clock_minus_host};
}

}  // namespace mocap::cameras
