#pragma once

#include <memory>
#include <stop_token>

#include "module/datagram_port.h"
#include "module/trigger_desk.h"
#include "runtime/take_worker.h"

namespace mocap::runtime {

struct TriggerParts {
  std::unique_ptr<TriggerDesk> desk;
  std::unique_ptr<DatagramPort> port;
};

/// The trigger thread: receives the packets of remote triggers, passes their orders to the recorder of takes and sends
/// the answers. It waits for the network and for news of the recorder, never for the disk.
class TriggerWorker {
 public:
  /// `takes` outlives the worker.
  TriggerWorker(TriggerParts parts, TakeChannel& takes);

  /// Returns when stopped, after the last news.
  void run(const std::stop_token& stop);

 private:
  void hear_news();
  void execute(TriggerActions actions);
  bool pass(const TakeOrder& order);

  TriggerParts parts_;
  TakeChannel& takes_;
};

}  // namespace mocap::runtime
