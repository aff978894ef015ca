#include "wire/zmq_socket.h"

#include <zmq.h>

#include <cerrno>

namespace mocap::wire {
namespace {

zmq_msg_t* message(const unsigned char* raw) {
  return reinterpret_cast<zmq_msg_t*>(
      const_cast<unsigned char*>(raw));  // ZeroMQ's read functions take non-const pointers
}

}  // namespace

Error zmq_failure(const std::string& what) {
  const int code = zmq_errno();
  switch (code) {
    case EADDRINUSE:
      return {ErrorCode::Busy,
              what + ": another program listens there (another mocapd?); stop that program or choose another endpoint"};
    case EADDRNOTAVAIL:
    case ENODEV: return {ErrorCode::NotFound, what + ": this machine has no such address"};
    case EINVAL:
    case EPROTONOSUPPORT: return {ErrorCode::InvalidArgument, what + ": " + zmq_strerror(code)};
    default: return {ErrorCode::Io, what + ": " + zmq_strerror(code)};
  }
}

ZmqSocket::~ZmqSocket() { close(); }

Status ZmqSocket::open(const ZmqContext& context, int kind, const std::string& who) {
  who_ = who;
  if (context.get() != nullptr) socket_ = zmq_socket(context.get(), kind);
  if (socket_ == nullptr) return zmq_failure(who_ + ": no ZeroMQ socket");
  return {};
}

void ZmqSocket::close() {
  if (socket_ != nullptr) zmq_close(socket_);
  socket_ = nullptr;
}

Status ZmqSocket::set(int option, int value) {
  if (zmq_setsockopt(socket_, option, &value, sizeof(value)) == 0) return {};
  return zmq_failure(who_ + ": cannot set option " + std::to_string(option) + " to " + std::to_string(value));
}

Status ZmqSocket::set(int option, std::string_view bytes) {
  if (zmq_setsockopt(socket_, option, bytes.data(), bytes.size()) == 0) return {};
  return zmq_failure(who_ + ": cannot set option " + std::to_string(option));
}

Status ZmqSocket::set_wide(int option, std::int64_t value) {
  if (zmq_setsockopt(socket_, option, &value, sizeof(value)) == 0) return {};
  return zmq_failure(who_ + ": cannot set option " + std::to_string(option) + " to " + std::to_string(value));
}

void ZmqSocket::catch_up() const {
  int events = 0;
  std::size_t size = sizeof(events);
  zmq_getsockopt(socket_, ZMQ_EVENTS, &events, &size);
}

std::string ZmqSocket::last_endpoint() const {
  char bound[512] = {};
  std::size_t size = sizeof(bound);
  if (zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, bound, &size) != 0) return {};
  return bound;
}

ZmqMessage::ZmqMessage() : raw_{} {
  static_assert(sizeof(zmq_msg_t) == kSize && alignof(zmq_msg_t) <= alignof(void*));
  zmq_msg_init(message(raw_));
}

ZmqMessage::~ZmqMessage() { zmq_msg_close(message(raw_)); }

bool ZmqMessage::receive(const ZmqSocket& from) { return zmq_msg_recv(message(raw_), from.get(), ZMQ_DONTWAIT) >= 0; }

bool ZmqMessage::has_more() const { return zmq_msg_more(message(raw_)) != 0; }

std::string_view ZmqMessage::bytes() const {
  return {static_cast<const char*>(zmq_msg_data(message(raw_))), zmq_msg_size(message(raw_))};
}

int ZmqMessage::connection() const { return zmq_msg_get(message(raw_), ZMQ_SRCFD); }

std::string_view ZmqMessage::user() const {
  const char* user = zmq_msg_gets(message(raw_), "User-Id");
  return user == nullptr ? std::string_view{} : std::string_view{user};
}

}  // namespace mocap::wire
