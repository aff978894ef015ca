#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "web/http_message.h"
#include "web/worker.h"
#include "wire/zmq_control.h"

namespace mocap::web {

/// The findings of `mocapctl preflight`. Requests that arrive while a check runs get the findings of this check. All
/// methods are called by the thread of the server's loop; a worker thread runs the check, which takes 2.2 s.
class PreflightSite {
 public:
  using RunHere = std::function<void(std::function<void()>)>;
  using Done = std::function<void(HttpReply)>;

  /// Fails with InvalidArgument if the endpoint or a key is malformed.
  static Result<std::unique_ptr<PreflightSite>> open(const wire::ControlClient::Settings& control, RunHere run_here);

  /// `takes`: folder of the takes; empty: unknown. The reply is a JSON array, as of `mocapctl preflight --json`.
  void answer(const std::filesystem::path& takes, Done done);

  bool is_busy() const { return worker_.is_busy(); }

 private:
  PreflightSite(std::unique_ptr<wire::ControlClient> client, RunHere run_here)
      : client_(std::move(client)), run_here_(std::move(run_here)) {}

  std::unique_ptr<wire::ControlClient> client_;  // of the worker's thread
  RunHere run_here_;
  std::vector<Done> waiting_;
  Worker worker_;  // last: its thread uses the others
};

}  // namespace mocap::web
