#include "web/control_worker.h"

#include <utility>

namespace mocap::web {

Result<std::unique_ptr<ControlWorker>> ControlWorker::open(const wire::ControlClient::Settings& settings) {
  auto client = wire::ControlClient::open(settings);
  if (!client) return client.error();
  return std::unique_ptr<ControlWorker>(new ControlWorker(*std::move(client)));
}

bool ControlWorker::ask(std::string request, Duration patience, Done done) {
  return worker_.run([this, request = std::move(request), patience, done = std::move(done)] {
    done(client_->ask(request, patience));
  });
}

}  // namespace mocap::web
