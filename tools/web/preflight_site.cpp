#include "web/preflight_site.h"

#include <utility>

#include "lib/preflight/daemon_facts.h"

namespace mocap::web {
namespace {

std::string findings_of(wire::ControlClient& client, const std::filesystem::path& takes) {
  Result<preflight::PreflightFacts> facts = preflight::ask_daemon(client);
  if (!facts) return preflight::json_of({preflight::silent_daemon(facts.error())});
  preflight::look_at_files(takes, {}, *facts);
  return preflight::json_of(preflight::examine_daemon(*facts));
}

}  // namespace

Result<std::unique_ptr<PreflightSite>> PreflightSite::open(const wire::ControlClient::Settings& control,
                                                           RunHere run_here) {
  auto client = wire::ControlClient::open(control);
  if (!client) return client.error();
  return std::unique_ptr<PreflightSite>(new PreflightSite(*std::move(client), std::move(run_here)));
}

void PreflightSite::answer(const std::filesystem::path& takes, Done done) {
  waiting_.push_back(std::move(done));
  if (waiting_.size() > 1) return;
  worker_.run([this, takes] {
    run_here_([this, findings = findings_of(*client_, takes)] {
      for (const Done& tell : std::exchange(waiting_, {})) tell({200, "application/json", findings + '\n'});
    });
  });
}

}  // namespace mocap::web
