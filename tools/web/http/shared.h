#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "web/feed/hub.h"
#include "web/site.h"

// Only http/server.cpp includes the headers of this folder that have sessions (decision 0002).
namespace mocap::web {

inline constexpr std::size_t kMaxConnections = 128;
inline constexpr std::size_t kMaxConnectionsOfOne = 64;  ///< of one address

/// The connections that are open, by address.
class Connections {
 public:
  /// Returns whether one more connection of `address` is permitted, and counts it then.
  bool add(const std::string& address) {
    const auto found = by_address_.find(address);  // a refused address leaves no entry
    const std::size_t count = found == by_address_.end() ? 0 : found->second;
    if (total_ >= kMaxConnections || count >= kMaxConnectionsOfOne) return false;
    ++total_;
    ++by_address_[address];
    return true;
  }
  void remove(const std::string& address) {
    --total_;
    if (--by_address_[address] == 0) by_address_.erase(address);
  }
  /// Number of addresses in memory: those with an open connection.
  std::size_t addresses() const noexcept { return by_address_.size(); }

 private:
  std::size_t total_ = 0;
  std::map<std::string, std::size_t> by_address_;
};

class WebSocketSession;

/// The objects that all sessions use.
struct Shared {
  Site& site;
  Hub& hub;
  std::chrono::nanoseconds timeout;
  std::function<void()> topics_changed;
  Connections connections = {};
  std::set<WebSocketSession*> sockets = {};
};

/// Counts its connection as long as it lives.
class Place {
 public:
  Place(Shared& shared, std::string address) : shared_(&shared), address_(std::move(address)) {}
  Place(Place&& other) noexcept : shared_(std::exchange(other.shared_, nullptr)), address_(std::move(other.address_)) {}
  Place& operator=(Place&&) = delete;
  ~Place() {
    if (shared_ != nullptr) shared_->connections.remove(address_);
  }

 private:
  Shared* shared_;
  std::string address_;
};

}  // namespace mocap::web
