#include "wire/forward_request.h"

#include <fmt/format.h>

#include <memory>

#include "wire/codec/control_codec.h"
#include "wire/endpoint.h"
#include "wire/zmq_control.h"

namespace mocap::wire {
namespace {

// "tcp://ADDRESS" and ":PORT" of an endpoint.
std::string address_of(const std::string& endpoint) { return endpoint.substr(0, endpoint.rfind(':')); }
std::string port_of(const std::string& endpoint) { return endpoint.substr(endpoint.rfind(':')); }

bool is_any_address(const std::string& endpoint) {
  const std::string address = address_of(endpoint);
  return address == "tcp://*" || address == "tcp://0.0.0.0" || address == "tcp://[::]";
}

ErrorCode error_code_of(v1::Code code) {
  switch (code) {
    case v1::CODE_UNSUPPORTED: return ErrorCode::Unsupported;
    case v1::CODE_NOT_FOUND: return ErrorCode::NotFound;
    case v1::CODE_TIMEOUT: return ErrorCode::Timeout;
    default: return ErrorCode::InvalidArgument;
  }
}

}  // namespace

Result<std::string> control_of_node(const std::string& control, const std::string& node) {
  if (control.empty() || control.ends_with(":*")) {
    return Error{ErrorCode::Unsupported,
                 fmt::format("the node at {} receives no requests; set [control] endpoint of the node", node)};
  }
  if (is_local(node)) return is_any_address(control) ? "tcp://127.0.0.1" + port_of(control) : control;
  if (is_any_address(control)) return address_of(node) + port_of(control);
  if (!is_local(control)) return control;
  return Error{ErrorCode::Unsupported,
               fmt::format("the node at {} receives requests of its own machine only, at {}; set [control] endpoint of "
                           "the node to an address that this machine reaches",
                           node, control)};
}

Status forward_request(const std::string& endpoint, const ClientKeys& keys, const ControlRequest& request,
                       Duration patience) {
  const Result<std::unique_ptr<ControlClient>> client = ControlClient::open({endpoint, keys});
  if (!client) return client.error();
  const Result<std::string> bytes = (*client)->ask(encode(request).SerializeAsString(), patience);
  if (!bytes) return bytes.error();
  v1::Answer answer;
  if (!answer.ParseFromString(*bytes)) {
    return Error{ErrorCode::Io, fmt::format("{}: an answer that is none of mocap.v1", endpoint)};
  }
  if (answer.code() == v1::CODE_DONE) return {};
  return Error{error_code_of(answer.code()), answer.message()};
}

}  // namespace mocap::wire
