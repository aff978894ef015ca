#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "bridges/natnet/command.h"
#include "lib/cli/key_options.h"
#include "mocap_client.h"

namespace mocap::natnet {

/// Sends orders about takes to the daemon's control endpoint, one after another, on a thread of its own, because the
/// answer may take seconds. The log has the answers.
class TakeOrders {
 public:
  /// Orders that may wait for the answer to another one.
  static constexpr std::size_t kMaxWaiting = 4;

  /// Start the program's EventLoop first, or call block_end_signals(): the thread must not get the signals.
  /// Returns nullptr if the endpoint or a key is invalid, with the reason in `fault`.
  static std::unique_ptr<TakeOrders> open(const std::string& endpoint, const cli::KeyOptions& keys, std::string& fault);
  /// Waits for the answer to the order that was sent, at most 30 s. Of the waiting orders the first end of a take is
  /// sent, with at most 2 s for its answer; the others are dropped. The log says that it waits.
  ~TakeOrders();
  TakeOrders(const TakeOrders&) = delete;
  TakeOrders& operator=(const TakeOrders&) = delete;

  /// Never waits. Returns false if too many orders wait.
  bool order(const Record& wanted);

 private:
  explicit TakeOrders(mocap_control* control);
  void run();
  void send(const Record& wanted, std::int32_t patience_ms);

  mocap_control* control_;
  mocap_answer* answer_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Record> waiting_;
  bool stopping_ = false;
  bool asking_ = false;  // the answer to an order is awaited
  std::thread thread_;
};

}  // namespace mocap::natnet
