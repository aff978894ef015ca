#include "web/control_worker.h"

#include <utility>

namespace mocap::web {

Result<std::unique_ptr<ControlWorker>> ControlWorker::open(const wire::ControlClient::Settings& settings,
                                                           Duration patience) {
  auto client = wire::ControlClient::open(settings);
  if (!client) return client.error();
  return std::unique_ptr<ControlWorker>(new ControlWorker(*std::move(client), patience));
}

ControlWorker::ControlWorker(std::unique_ptr<wire::ControlClient> client, Duration patience)
    : client_(std::move(client)), patience_(patience) {}

bool ControlWorker::ask(std::string request, Done done) {
  return worker_.run(
      [this, request = std::move(request), done = std::move(done)] { done(client_->ask(request, patience_)); });
}

}  // namespace mocap::web
