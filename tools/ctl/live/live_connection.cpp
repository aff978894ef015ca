#include "ctl/live/live_connection.h"

#include <utility>

#include "base/exit_codes.h"
#include "base/time.h"
#include "wire/codec/control_codec.h"

namespace mocap::ctl {

int exit_code_of(v1::Code code) {
  switch (code) {
    case v1::CODE_DONE: return kExitOk;
    case v1::CODE_FORBIDDEN: return kExitNoPerm;
    case v1::CODE_INVALID:
    case v1::CODE_NOT_FOUND: return kExitData;
    default: return kExitUnavailable;
  }
}

Result<std::unique_ptr<wire::ControlClient>, LiveFailure> connect(const LiveOptions& options) {
  wire::ControlClient::Settings settings;
  settings.endpoint = options.endpoint;
  Result<wire::ClientKeys> keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  if (!keys) return LiveFailure{kExitUsage, keys.error().message};
  settings.keys = *std::move(keys);
  auto client = wire::ControlClient::open(settings);
  if (!client) return LiveFailure{kExitUsage, client.error().message};
  return std::move(*client);
}

Result<v1::Answer, LiveFailure> ask_once(wire::ControlClient& client, const ControlRequest& request, double timeout_s) {
  v1::Request message = wire::encode(request);
  message.set_id(1);
  const Result<std::string> came = client.ask(message.SerializeAsString(), from_s(timeout_s));
  if (!came) return LiveFailure{kExitUnavailable, came.error().message};
  v1::Answer answer;
  if (!answer.ParseFromString(*came)) return LiveFailure{kExitData, "the answer is not a mocap.v1 message"};
  return answer;
}

void add_endpoint_options(cli::App& command, LiveOptions& options) {
  command.add_option("--endpoint", options.endpoint, "the daemon's control endpoint")->capture_default_str();
  cli::add_key_options(command, options.keys);
  command.add_flag("--json", options.json, "print the answer as JSON");
}

void add_connection_options(cli::App& command, LiveOptions& options) {
  add_endpoint_options(command, options);
  command.add_option("--timeout-s", options.timeout_s, "longest wait for the answer")
      ->check(cli::Range(0.1, 600.0))
      ->capture_default_str();
}

}  // namespace mocap::ctl
