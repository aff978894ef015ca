#include "ctl/preflight_command.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/exit_codes.h"
#include "lib/cli/key_options.h"
#include "lib/preflight/daemon_facts.h"
#include "settings/daemon_settings.h"
#include "wire/zmq_control.h"

namespace mocap::ctl {
namespace {

struct PreflightOptions {
  std::string endpoint = "tcp://127.0.0.1:5571";
  cli::KeyOptions keys;
  std::filesystem::path config;
  bool json = false;
};

int run(const PreflightOptions& options) {
  Result<wire::ClientKeys> keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  const auto fail = [](const std::string& why, int code) {
    fmt::print(stderr, "mocapctl: {}\n", why);
    return code;
  };
  if (!keys) return fail(keys.error().message, kExitUsage);
  auto client = wire::ControlClient::open({options.endpoint, *std::move(keys)});
  if (!client) return fail(client.error().message, kExitUsage);
  Result<preflight::PreflightFacts> facts = preflight::ask_daemon(**client);
  if (!facts) {
    preflight::print({preflight::silent_daemon(facts.error())}, options.json);
    return kExitUnavailable;
  }
  if (!options.config.empty()) {
    const auto settings = settings::load_daemon_settings(options.config);
    if (!settings) return fail(settings::to_text(settings.error()), kExitConfig);
    preflight::look_at_files(settings->takes.folder, settings->capture.rig_file, *facts);
  }
  const std::vector<preflight::Finding> findings = preflight::examine_daemon(*facts);
  print(findings, options.json);
  return is_bad(findings) ? kExitUnavailable : kExitOk;
}

}  // namespace

void add_preflight_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<PreflightOptions>();
  cli::App* const preflight = app.add_subcommand(
      "preflight", "check whether the running daemon is ready to record; exit code 69 if a finding is bad");
  preflight->examples(
      "  mocapctl preflight\n"
      "  mocapctl preflight --config /etc/mocapd/mocapd.toml --json");
  preflight->add_option("--endpoint", options->endpoint, "the daemon's control endpoint")->capture_default_str();
  cli::add_key_options(*preflight, options->keys);
  preflight
      ->add_option("--config", options->config, "the daemon's configuration: also check disk and age of the rig file")
      ->type_name("FILE")
      ->check(cli::ExistingFile{});
  preflight->add_flag("--json", options->json, "print a JSON array of findings");
  preflight->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace mocap::ctl
