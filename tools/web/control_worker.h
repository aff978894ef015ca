#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "base/result.h"
#include "base/time.h"
#include "web/worker.h"
#include "wire/zmq_control.h"

namespace mocap::web {

/// Sends requests to the daemon, one after the other, in a thread of its own.
class ControlWorker {
 public:
  /// `answer`: a serialised v1::Answer, or the reason why none came.
  using Done = std::function<void(Result<std::string> answer)>;

  /// Fails with InvalidArgument if the endpoint or a key is malformed.
  static Result<std::unique_ptr<ControlWorker>> open(const wire::ControlClient::Settings& settings);
  /// Requests that wait get no answer.
  ~ControlWorker() = default;
  ControlWorker(const ControlWorker&) = delete;
  ControlWorker& operator=(const ControlWorker&) = delete;

  /// Queues a serialised v1::Request; the daemon has `patience` to answer, once it was sent. The worker's thread calls
  /// `done`. Returns false, and calls nothing, if 16 requests wait.
  bool ask(std::string request, Duration patience, Done done);
  /// Whether a request waits for its answer: the destructor would wait too.
  bool is_busy() const { return worker_.is_busy(); }

 private:
  explicit ControlWorker(std::unique_ptr<wire::ControlClient> client) : client_(std::move(client)) {}

  std::unique_ptr<wire::ControlClient> client_;  // of the worker's thread
  Worker worker_;                                // last: stops before the rest is destroyed
};

}  // namespace mocap::web
