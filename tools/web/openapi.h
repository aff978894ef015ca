#pragma once

#include <string>

namespace mocap::web {

/// The description of the API in OpenAPI 3.0, as JSON: every method with the schema of its parameters, made from the
/// descriptor of the control protocol.
std::string openapi_json();

}  // namespace mocap::web
