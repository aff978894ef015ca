#include "ctl/preflight_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "base/exit_codes.h"
#include "ctl/preflight.h"
#include "lib/cli/key_options.h"
#include "settings/daemon_settings.h"
#include "wire/zmq_control.h"

namespace mocap::ctl {
namespace {

constexpr Duration kAnswerWithin = std::chrono::seconds(5);
constexpr Duration kCheck = std::chrono::milliseconds(2200);  // two reports of health
// A take of eight cameras at 120 Hz with 40 blobs each, before compression; the estimate until a take was recorded.
constexpr double kUsualTake_bytes_s = 4e6;

struct PreflightOptions {
  std::string endpoint = "tcp://127.0.0.1:5571";
  cli::KeyOptions keys;
  std::filesystem::path config;
  bool json = false;
};

Result<v1::Answer> ask(wire::ControlClient& client, const v1::Request& request) {
  const Result<std::string> came = client.ask(request.SerializeAsString(), kAnswerWithin);
  if (!came) return came.error();
  v1::Answer answer;
  if (!answer.ParseFromString(*came)) return Error{ErrorCode::InvalidArgument, "the answer is not a mocap.v1 message"};
  if (answer.code() != v1::CODE_DONE) return Error{ErrorCode::Io, answer.message()};
  return answer;
}

Result<v1::Status> ask_status(wire::ControlClient& client) {
  v1::Request request;
  request.set_id(1);
  request.mutable_status();
  Result<v1::Answer> answer = ask(client, request);
  if (!answer) return answer.error();
  return std::move(*answer->mutable_status());
}

Result<PreflightFacts> ask_daemon(wire::ControlClient& client) {
  PreflightFacts facts;
  v1::Request request;
  request.set_id(1);
  request.mutable_description();
  Result<v1::Answer> described = ask(client, request);
  if (!described) return described.error();
  facts.description = std::move(*described->mutable_description());
  Result<v1::Status> before = ask_status(client);
  if (!before) return before.error();
  facts.before = *std::move(before);
  std::this_thread::sleep_for(kCheck);
  Result<v1::Status> now = ask_status(client);
  if (!now) return now.error();
  facts.now = *std::move(now);
  return facts;
}

double take_rate_bytes_s(const v1::TakeHealth& take) {
  constexpr double kLongEnough_s = 5.0;
  if (take.seconds() < kLongEnough_s) return kUsualTake_bytes_s;
  return std::max(1.0, static_cast<double>(take.size_bytes()) / take.seconds());
}

// What only files of this machine tell. Unknown facts stay empty.
void look_at_files(const settings::DaemonSettings& settings, PreflightFacts& facts) {
  std::error_code error;
  const std::filesystem::path takes = settings.takes.folder;
  const auto space = std::filesystem::space(std::filesystem::exists(takes, error) ? takes : takes.parent_path(), error);
  if (!error)
    facts.free_minutes = static_cast<double>(space.available) / take_rate_bytes_s(facts.now.health().take()) / 60.0;
  const auto written = std::filesystem::last_write_time(settings.capture.rig_file, error);
  if (!error) {
    const auto age = std::filesystem::file_time_type::clock::now() - written;
    facts.calibration_age_days = std::chrono::duration<double>(age).count() / 86400.0;
  }
}

int run(const PreflightOptions& options) {
  Result<wire::ClientKeys> keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  const auto fail = [](const std::string& why, int code) {
    fmt::print(stderr, "mocapctl: {}\n", why);
    return code;
  };
  if (!keys) return fail(keys.error().message, kExitUsage);
  auto client = wire::ControlClient::open({options.endpoint, *std::move(keys)});
  if (!client) return fail(client.error().message, kExitUsage);
  Result<PreflightFacts> facts = ask_daemon(**client);
  if (!facts) {
    const std::vector<Finding> silent{{"daemon", Verdict::Bad, facts.error().message, "systemctl status mocapd"}};
    print(silent, options.json);
    return kExitUnavailable;
  }
  if (!options.config.empty()) {
    const auto settings = settings::load_daemon_settings(options.config);
    if (!settings) return fail(settings::to_text(settings.error()), kExitConfig);
    look_at_files(*settings, *facts);
  }
  const std::vector<Finding> findings = examine_daemon(*facts);
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
