#include "bridges/vrpn/message.h"

#include <bit>
#include <charconv>
#include <cmath>

namespace mocap::vrpn {
namespace {

constexpr std::string_view kMagic = "vrpn: ver. 07.38";  // the newest version whose messages are known to be these
constexpr std::size_t kMajor_bytes = std::string_view("vrpn: ver. 07.").size();
constexpr std::size_t kSequenceOffset = 20;

template <class Whole>
void put_whole(std::string& into, Whole value) {
  for (int shift = static_cast<int>(sizeof value) * 8 - 8; shift >= 0; shift -= 8) {
    into.push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
}

void put(std::string& into, std::int32_t value) { put_whole(into, static_cast<std::uint32_t>(value)); }
void put(std::string& into, double value) { put_whole(into, std::bit_cast<std::uint64_t>(value)); }
void put(std::string& into, mocap_vec3 v) {
  for (const float value : {v.x, v.y, v.z}) put(into, static_cast<double>(value));
}

std::int32_t whole_at(std::string_view bytes, std::size_t start) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(start, 4)) value = value << 8U | static_cast<unsigned char>(byte);
  return static_cast<std::int32_t>(value);
}

std::size_t padded(std::size_t size) { return (size + kAlignment_bytes - 1) / kAlignment_bytes * kAlignment_bytes; }

std::string begin_tracker_payload(std::int32_t sensor) {
  std::string payload;
  put(payload, sensor);
  put(payload, 0);  // aligns the doubles
  return payload;
}

}  // namespace

Stamp stamp_of(std::int64_t unix_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  std::int64_t seconds = unix_ns / kSecond_ns;
  std::int64_t rest_ns = unix_ns % kSecond_ns;
  if (rest_ns < 0) {
    --seconds;
    rest_ns += kSecond_ns;
  }
  return {static_cast<std::int32_t>(seconds), static_cast<std::int32_t>(rest_ns / 1000)};
}

std::string cookie() {
  std::string bytes(kMagic);
  bytes += "  0";  // log mode: none
  bytes.resize(kCookie_bytes, '\0');
  return bytes;
}

bool is_cookie(std::string_view bytes) {
  return bytes.size() == kCookie_bytes && bytes.substr(0, kMajor_bytes) == kMagic.substr(0, kMajor_bytes);
}

std::string message(Stamp at, std::int32_t sender, std::int32_t type, std::string_view payload) {
  std::string bytes;
  bytes.reserve(kHeader_bytes + padded(payload.size()));
  for (const std::int32_t field :
       {static_cast<std::int32_t>(kHeader_bytes + payload.size()), at.seconds, at.microseconds, sender, type, 0}) {
    put(bytes, field);
  }
  bytes += payload;
  bytes.resize(kHeader_bytes + padded(payload.size()), '\0');
  return bytes;
}

void number_message(std::string& bytes, std::size_t start, std::uint32_t sequence) {
  std::string number;
  put_whole(number, sequence);
  bytes.replace(start + kSequenceOffset, number.size(), number);
}

std::string describe_name(std::string_view name) {
  std::string payload;
  put(payload, static_cast<std::int32_t>(name.size() + 1));
  payload += name;
  payload.push_back('\0');
  return payload;
}

std::optional<std::string_view> name_in(std::string_view payload) {
  if (payload.size() < 4) return std::nullopt;
  const std::string_view name = payload.substr(4, payload.substr(4).find('\0'));
  if (name.empty() || name.size() > kMaxName_bytes) return std::nullopt;
  return name;
}

std::string pose_payload(std::int32_t sensor, mocap_vec3 position, mocap_quat rotation) {
  std::string payload = begin_tracker_payload(sensor);
  put(payload, position);
  put(payload, mocap_vec3{rotation.x, rotation.y, rotation.z});
  put(payload, static_cast<double>(rotation.w));
  return payload;
}

std::string velocity_payload(std::int32_t sensor, mocap_vec3 velocity, mocap_vec3 spin) {
  constexpr double kInterval_s = 0.01;
  std::string payload = begin_tracker_payload(sensor);
  put(payload, velocity);
  const double speed =
      std::hypot(static_cast<double>(spin.x), static_cast<double>(spin.y), static_cast<double>(spin.z));
  const double half_angle = speed * kInterval_s / 2.0;
  // sin(a) / a tends to 1.
  const double scale = speed > 0.0 ? std::sin(half_angle) / speed : 0.0;
  for (const float axis : {spin.x, spin.y, spin.z}) put(payload, static_cast<double>(axis) * scale);
  put(payload, std::cos(half_angle));
  put(payload, kInterval_s);
  return payload;
}

std::string text_payload(Severity severity, std::string_view text) {
  constexpr std::size_t kMaxText_bytes = 1023;  // receivers keep 1024 with the final zero
  std::string payload;
  put(payload, static_cast<std::int32_t>(severity));
  put(payload, 0);
  payload += text.substr(0, kMaxText_bytes);
  payload.push_back('\0');
  return payload;
}

void MessageReader::append(std::string_view bytes) {
  bytes_.erase(0, used_);
  used_ = 0;
  bytes_ += bytes;
}

std::optional<Message> MessageReader::next() {
  const std::string_view left = std::string_view(bytes_).substr(used_);
  if (broken_ || left.size() < kHeader_bytes) return std::nullopt;
  const std::int32_t length = whole_at(left, 0);
  if (length < static_cast<std::int32_t>(kHeader_bytes) || length > static_cast<std::int32_t>(kMaxMessage_bytes)) {
    broken_ = true;
    return std::nullopt;
  }
  const std::size_t payload_bytes = static_cast<std::size_t>(length) - kHeader_bytes;
  if (left.size() < kHeader_bytes + padded(payload_bytes)) return std::nullopt;
  used_ += kHeader_bytes + padded(payload_bytes);
  constexpr std::size_t kSender = 12;
  constexpr std::size_t kType = 16;
  return Message{whole_at(left, kSender), whole_at(left, kType), left.substr(kHeader_bytes, payload_bytes)};
}

std::optional<std::uint16_t> callback_port(std::string_view datagram) {
  constexpr std::size_t kMaxRequest_bytes = 256;
  if (datagram.size() > kMaxRequest_bytes) return std::nullopt;
  datagram = datagram.substr(0, datagram.find('\0'));
  const std::size_t space = datagram.rfind(' ');
  if (space == std::string_view::npos || space == 0) return std::nullopt;
  std::uint16_t port = 0;
  const char* const end = datagram.data() + datagram.size();
  const auto [stop, error] = std::from_chars(datagram.data() + space + 1, end, port);
  if (error != std::errc{} || stop != end || port == 0) return std::nullopt;
  return port;
}

}  // namespace mocap::vrpn
