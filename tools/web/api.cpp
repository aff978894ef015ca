#include "web/api.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "model/control.h"

namespace mocap::web {
namespace {

using google::protobuf::util::JsonParseOptions;
using google::protobuf::util::JsonPrintOptions;

// The requests that the role viewer may send; see control.proto.
constexpr std::array<std::string_view, 3> kReads = {"status", "description", "snapshot"};

constexpr Duration kReadPatience = std::chrono::seconds(5);
constexpr Duration kChangePatience = std::chrono::seconds(35);  // a take ends when the disk has all of it
constexpr Duration kLearningMargin = std::chrono::seconds(10);  // beside the cameras: masks are detected and saved

const google::protobuf::OneofDescriptor& requests() { return *v1::Request::descriptor()->FindOneofByName("what"); }

std::vector<Method> list_methods() {
  std::vector<Method> all;
  for (int i = 0; i < requests().field_count(); ++i) {
    const std::string& name = requests().field(i)->name();
    all.push_back({name, std::ranges::find(kReads, name) == kReads.end()});
  }
  return all;
}

std::string print(const google::protobuf::Message& message, bool defaults) {
  JsonPrintOptions options;
  options.always_print_primitive_fields = defaults;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok()) return "{}";
  return text;
}

}  // namespace

const std::vector<Method>& methods() {
  static const std::vector<Method> kAll = list_methods();
  return kAll;
}

const Method* find_method(std::string_view name) {
  const auto found = std::ranges::find(methods(), name, &Method::name);
  return found == methods().end() ? nullptr : &*found;
}

Result<v1::Request> request_of(const Method& method, const std::string& params_json) {
  v1::Request request;
  const auto* field = requests().containing_type()->FindFieldByName(method.name);
  google::protobuf::Message* params = request.GetReflection()->MutableMessage(&request, field);
  if (params_json.find_first_not_of(" \t\r\n") == std::string::npos) return request;
  const auto read = google::protobuf::util::JsonStringToMessage(params_json, params, JsonParseOptions());
  if (!read.ok()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{}: expected {} of control.proto as JSON: {}", method.name,
                                                         params->GetDescriptor()->name(), std::string(read.message()))};
  }
  return request;
}

bool is_change(const Method& method, const v1::Request& request) {
  const v1::CalibrationRequest::Action calibration = request.calibration().action();
  return method.changes && request.shots().action() != v1::ShotsRequest::ACTION_LIST &&
         request.mask().action() != v1::MaskRequest::ACTION_LIST &&
         calibration != v1::CalibrationRequest::ACTION_STATUS && calibration != v1::CalibrationRequest::ACTION_LIST;
}

bool is_learning(const v1::Request& request) {
  const v1::MaskRequest::Action action = request.mask().action();
  return request.has_mask() &&
         (action == v1::MaskRequest::ACTION_LEARN || action == v1::MaskRequest::ACTION_UNSPECIFIED);
}

Duration patience_of(const Method& method, const v1::Request& request) {
  if (is_learning(request)) return longest_learning(request.mask().images()) + kLearningMargin;
  return is_change(method, request) ? kChangePatience : kReadPatience;
}

std::string params_of(const v1::Request& request) {
  const auto* field = request.GetReflection()->GetOneofFieldDescriptor(request, &requests());
  return field == nullptr ? "{}" : print(request.GetReflection()->GetMessage(request, field), false);
}

std::string json_of(const v1::Answer& answer) { return print(answer, true); }

int http_status_of(v1::Code code) {
  switch (code) {
    case v1::CODE_DONE: return 200;
    case v1::CODE_INVALID: return 400;
    case v1::CODE_FORBIDDEN: return 403;
    case v1::CODE_NOT_FOUND: return 404;
    case v1::CODE_UNSUPPORTED: return 422;
    case v1::CODE_TIMEOUT: return 504;
    default: return 502;
  }
}

}  // namespace mocap::web
