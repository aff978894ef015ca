#pragma once

namespace mocap::wire {

/// A ZeroMQ context. Must outlive its sockets. A program that makes one is safe from a fault of libzmq by which a peer
/// could abort it (decisions/0009).
class ZmqContext {
 public:
  ZmqContext();
  ~ZmqContext();
  ZmqContext(const ZmqContext&) = delete;
  ZmqContext& operator=(const ZmqContext&) = delete;

  void* get() const { return context_; }

 private:
  void* context_;
};

}  // namespace mocap::wire
