#include "bridges/vrpn/session.h"

#include <utility>

namespace mocap::vrpn {
namespace {

// Bytes of the message that begins at `start`, with its padding.
std::size_t message_size(std::string_view bytes, std::size_t start) {
  std::size_t length = 0;
  for (const char byte : bytes.substr(start, 4)) length = length << 8U | static_cast<unsigned char>(byte);
  return (length + kAlignment_bytes - 1) / kAlignment_bytes * kAlignment_bytes;
}

}  // namespace

Session::Session(const Senders& senders) : senders_(senders), output_(cookie()) {}

bool Session::take(std::string_view bytes, std::int64_t unix_ns) {
  if (!greeted_) {
    const std::size_t more = std::min(bytes.size(), kCookie_bytes - cookie_.size());
    cookie_ += bytes.substr(0, more);
    bytes.remove_prefix(more);
    if (cookie_.size() < kCookie_bytes) return true;
    if (!take_cookie(unix_ns)) return false;
  }
  reader_.append(bytes);
  while (const auto message = reader_.next()) {
    if (handle(*message, unix_ns) == Step::Close) return false;
  }
  if (!reader_.broken()) return true;
  close("a message has an impossible length, expected 24 to " + std::to_string(MessageReader::kMaxMessage_bytes) +
        " bytes");
  return false;
}

bool Session::take_cookie(std::int64_t unix_ns) {
  if (!is_cookie(cookie_)) {
    close("the client does not begin with \"vrpn: ver. 07.\"");
    return false;
  }
  greeted_ = true;
  const Stamp at = stamp_of(unix_ns);
  for (std::int32_t type = 0; const std::string_view name : kTypeNames) {
    put(message(at, type++, kTypeDescription, describe_name(name)));
  }
  describe(unix_ns);
  return true;
}

void Session::describe(std::int64_t unix_ns) {
  if (!greeted_) return;
  const Stamp at = stamp_of(unix_ns);
  for (; described_ < senders_.names().size(); ++described_) {
    put(message(at, static_cast<std::int32_t>(described_), kSenderDescription,
                describe_name(senders_.names()[described_])));
  }
  update_wanted();
}

Session::Step Session::handle(const Message& message, std::int64_t unix_ns) {
  switch (message.type) {
    case kSenderDescription: note_sender(message); return Step::Continue;
    case kTypeDescription:
      if (name_in(message.payload) == kPing) ping_type_ = message.sender;
      return Step::Continue;
    case kUdpDescription:
      if (message.sender <= 0 || message.sender > UINT16_MAX) return close("the client described an invalid UDP port");
      udp_port_ = static_cast<std::uint16_t>(message.sender);
      return Step::Continue;
    case kDisconnect: return close("the client disconnected");
    default: break;
  }
  if (message.type == ping_type_) answer_ping(message.sender, unix_ns);
  return Step::Continue;  // other messages are requests that this server does not serve
}

Session::Step Session::close(std::string why) {
  fault_ = std::move(why);
  return Step::Close;
}

void Session::note_sender(const Message& message) {
  const auto name = name_in(message.payload);
  if (!name || (remote_senders_.size() >= kMaxNames && !remote_senders_.contains(message.sender))) return;
  remote_senders_[message.sender] = *name;
  if (const auto sender = senders_.find(*name)) wanted_.insert(*sender);
}

void Session::answer_ping(std::int32_t remote_sender, std::int64_t unix_ns) {
  const auto name = remote_senders_.find(remote_sender);
  if (name == remote_senders_.end()) return;
  const auto sender = senders_.find(name->second);
  if (!sender || output_.size() > kMaxPending_bytes) return;
  ++pings_;
  put(message(stamp_of(unix_ns), *sender, static_cast<std::int32_t>(Type::Pong), {}));
}

void Session::update_wanted() {
  for (const auto& [number, name] : remote_senders_) {
    if (const auto sender = senders_.find(name)) wanted_.insert(*sender);
  }
}

bool Session::wants(const Report& report) const {
  return wanted_.empty() ? !report.repeated : wanted_.contains(report.sender);
}

void Session::put(std::string bytes) {
  number_message(bytes, 0, sequence_++);
  output_ += bytes;
}

void Session::send(std::span<const Report> reports) {
  if (!greeted_) return;
  if (output_.size() > kMaxPending_bytes) {
    ++dropped_;
    return;
  }
  for (const Report& report : reports) {
    if (!wants(report)) continue;
    std::string bytes = report.messages;
    for (std::size_t at = 0; at < bytes.size(); at += message_size(bytes, at)) number_message(bytes, at, sequence_++);
    if (udp_port_) {
      send_by_udp(bytes);
    } else {
      output_ += bytes;
    }
  }
}

void Session::send_by_udp(const std::string& messages) {
  if (datagrams_.empty() || datagrams_.back().size() + messages.size() > kMaxDatagram_bytes) datagrams_.emplace_back();
  datagrams_.back() += messages;
}

void Session::send_text(Severity severity, std::string_view text, std::int64_t unix_ns) {
  if (!greeted_ || senders_.names().empty() || output_.size() > kMaxPending_bytes) return;
  const std::int32_t sender = wanted_.empty() ? 0 : *wanted_.begin();
  put(message(stamp_of(unix_ns), sender, static_cast<std::int32_t>(Type::Text), text_payload(severity, text)));
}

}  // namespace mocap::vrpn
