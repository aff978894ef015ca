#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace mocap::bridge {

/// A UDP socket that is connected to one receiver. On Linux and on Windows.
class UdpSender {
 public:
  /// A name with addresses of both kinds gets the packets at the one of IPv4.
  /// Returns nullptr if the host's name is unknown or the host cannot be reached, with the reason in `fault`.
  static std::unique_ptr<UdpSender> open(const std::string& host, const std::string& port, std::string& fault);
  ~UdpSender();
  UdpSender(const UdpSender&) = delete;
  UdpSender& operator=(const UdpSender&) = delete;

  /// Sends one packet. Returns false if this machine refuses it; a missing receiver may start later.
  bool send(std::string_view packet);

  /// "HOST:PORT" as they were given.
  const std::string& name() const { return name_; }

  /// Whether the receiver's address is a loopback address of this machine.
  bool is_local() const;

 private:
  struct Impl;
  UdpSender(std::unique_ptr<Impl> impl, std::string name);
  std::unique_ptr<Impl> impl_;
  std::string name_;
};

}  // namespace mocap::bridge
