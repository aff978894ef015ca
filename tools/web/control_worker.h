#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/result.h"
#include "wire/zmq_control.h"

namespace mocap::web {

/// Sends requests to the daemon, one after the other, in a thread of its own.
class ControlWorker {
 public:
  /// `answer`: a serialised v1::Answer, or the reason why none came.
  using Done = std::function<void(Result<std::string> answer)>;

  /// Fails with InvalidArgument if the endpoint or a key is malformed.
  static Result<std::unique_ptr<ControlWorker>> open(const wire::ControlClient::Settings& settings, Duration patience);
  /// Requests that wait get no answer.
  ~ControlWorker();
  ControlWorker(const ControlWorker&) = delete;
  ControlWorker& operator=(const ControlWorker&) = delete;

  /// Queues a serialised v1::Request. The worker's thread calls `done`. Returns false, and calls nothing, if 16
  /// requests wait.
  bool ask(std::string request, Done done);
  /// Whether a request waits for its answer: the destructor would wait too.
  bool is_busy() const { return busy_; }

 private:
  struct Waiting {
    std::string request;
    Done done;
  };
  ControlWorker(std::unique_ptr<wire::ControlClient> client, Duration patience);
  void run(const std::stop_token& stop);

  std::unique_ptr<wire::ControlClient> client_;  // of the thread
  Duration patience_;
  std::atomic<bool> busy_ = false;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Waiting> waiting_;  // guarded by mutex_
  std::jthread thread_;          // last: stops before the rest is destroyed
};

}  // namespace mocap::web
