#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "mocap/v1/control.pb.h"
#include "wire/role.h"

namespace mocap::web {

inline constexpr std::string_view kApiPath = "/api/v1/";

/// A method of the API: a member of Request.what of the control protocol.
struct Method {
  std::string name;
  bool changes = false;  ///< POST, and role operator if the request `is_change`; otherwise GET and role viewer
};

/// All methods, from the descriptor of the control protocol, so that a new request is a method at once.
const std::vector<Method>& methods();
/// nullptr: there is no such method.
const Method* find_method(std::string_view name);

/// Makes the request `method` from its parameters in Protobuf's JSON. Empty parameters: none. Fails with
/// InvalidArgument; the message names the fault.
Result<v1::Request> request_of(const Method& method, const std::string& params_json);

/// Whether the request needs the role operator: all of a method that changes, but for a list of the
/// shots, and for status and list of the calibration.
bool is_change(const Method& method, const v1::Request& request);

/// Whether the request is answered only when cameras have delivered images, which takes up to 70 s and more.
bool is_learning(const v1::Request& request);

/// How long the daemon may take for its answer.
Duration patience_of(const Method& method, const v1::Request& request);

/// The parameters of a request as one line of JSON, for the audit log.
std::string params_of(const v1::Request& request);

/// The answer in Protobuf's JSON, with the fields that have their default value.
std::string json_of(const v1::Answer& answer);

/// The status of HTTP for an answer: 200, 400, 403, 404, 422, 502 or 504.
int http_status_of(v1::Code code);

}  // namespace mocap::web
