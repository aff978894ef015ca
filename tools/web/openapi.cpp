#include "web/openapi.h"

#include <google/protobuf/descriptor.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "web/api.h"

namespace mocap::web {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using nlohmann::json;

// The schemas of all messages that a message contains.
class Schemas {
 public:
  json reference(const Descriptor& message) {
    const std::string name = name_of(message);
    if (!all_.contains(name)) {
      all_[name] = json::object();  // ends the recursion of a message that contains itself
      json properties = json::object();
      for (int i = 0; i < message.field_count(); ++i)
        properties[message.field(i)->json_name()] = schema_of(*message.field(i));
      all_[name] = {{"type", "object"}, {"properties", properties}};
    }
    return {{"$ref", "#/components/schemas/" + name}};
  }

  json take() { return json(std::move(all_)); }

 private:
  // "CaptureRequest", "BlobRecording.Camera"
  static std::string name_of(const Descriptor& message) {
    return message.full_name().substr(message.file()->package().size() + 1);
  }

  json schema_of(const FieldDescriptor& field) {
    json schema = single(field);
    if (field.is_repeated()) return {{"type", "array"}, {"items", std::move(schema)}};
    return schema;
  }

  // Protobuf's JSON writes integers of 64 bit as strings, because JavaScript's numbers have 53 bit.
  json single(const FieldDescriptor& field) {
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_BOOL: return {{"type", "boolean"}};
      case FieldDescriptor::CPPTYPE_STRING: return {{"type", "string"}};
      case FieldDescriptor::CPPTYPE_INT64:
      case FieldDescriptor::CPPTYPE_UINT64: return {{"type", "string"}, {"format", "int64"}};
      case FieldDescriptor::CPPTYPE_INT32:
      case FieldDescriptor::CPPTYPE_UINT32: return {{"type", "integer"}};
      case FieldDescriptor::CPPTYPE_FLOAT: return {{"type", "number"}, {"format", "float"}};
      case FieldDescriptor::CPPTYPE_DOUBLE: return {{"type", "number"}, {"format", "double"}};
      case FieldDescriptor::CPPTYPE_ENUM: return names_of(*field.enum_type());
      case FieldDescriptor::CPPTYPE_MESSAGE: return reference(*field.message_type());
    }
    return json::object();
  }

  static json names_of(const EnumDescriptor& values) {
    json names = json::array();
    for (int i = 0; i < values.value_count(); ++i) names.push_back(values.value(i)->name());
    return {{"type", "string"}, {"enum", std::move(names)}};
  }

  std::map<std::string, json> all_;
};

json content(json schema) { return {{"content", {{"application/json", {{"schema", std::move(schema)}}}}}}; }

json answers(Schemas& schemas) {
  const std::pair<const char*, const char*> kCodes[] = {
      {"200", "done"},
      {"400", "the request is invalid; message names the fault"},
      {"401", "a token is missing or unknown"},
      {"403", "the role does not permit the request, or it comes from another site"},
      {"404", "there is no such subject, camera or method"},
      {"422", "the camera or the run does not support the request"},
      {"429", "too many requests"},
      {"502", "the request failed"},
      {"503", "the daemon does not answer, or too many requests wait"},
      {"504", "a thread of the daemon did not answer in time"},
  };
  json all = json::object();
  const json answer = schemas.reference(*v1::Answer::descriptor());
  for (const auto& [code, meaning] : kCodes) {
    all[code] = content(answer);
    all[code]["description"] = meaning;
  }
  return all;
}

json operation_of(const Method& method, Schemas& schemas) {
  json operation{{"operationId", method.name},
                 {"summary", method.name == "shots" || method.name == "mask"
                                 ? "role viewer to list, otherwise operator; see control.proto"
                             : method.changes ? "role operator; see control.proto"
                                              : "role viewer; see control.proto"},
                 {"responses", answers(schemas)}};
  if (!method.changes) return {{"get", std::move(operation)}};
  operation["requestBody"] =
      content(schemas.reference(*v1::Request::descriptor()->FindFieldByName(method.name)->message_type()));
  return {{"post", std::move(operation)}};
}

// The requests that this program itself answers, beside those of the control protocol.
struct OwnMethod {
  const char* path;
  const char* method;
  const char* id;
  const char* summary;
  const char* type;                                 ///< of the reply
  std::vector<std::pair<const char*, bool>> query;  ///< names, and whether each is needed
  const char* body = "application/json";            ///< type of the body of a POST
};

const std::vector<OwnMethod>& own_methods() {
  static const std::vector<OwnMethod> kAll{
      {"/api/v1/preflight",
       "get",
       "preflight",
       "the findings of mocapctl preflight: check, verdict, what, cure; minutes of takes that fit on the disk",
       "application/json",
       {}},
      {"/api/v1/subjects/import",
       "post",
       "importSubject",
       "role operator: makes a marker set from a C3D file of at most 8 MiB as mocapctl subject import does, and adds "
       "the "
       "subject; code, message, report, warnings. static=true: a person stands in T-pose or A-pose",
       "application/json",
       {{"name", true}, {"static", false}},
       "application/octet-stream"},
      {"/api/v1/takes", "get", "takes", "the newest 500 takes of the folder", "application/json", {}},
      {"/api/v1/takes/{name}", "get", "showTake", "a take as of mocapctl take show --json", "application/json", {}},
      {"/api/v1/takes/{name}/verify", "get", "verifyTake", "valid, and the faults", "application/json", {}},
      {"/api/v1/takes/{name}/snapshots",
       "get",
       "takeSnapshots",
       "messages of a take: length of the rest (4 bytes, little-endian), 'd' (Description) or 's' (Snapshot), seconds "
       "since the start (double), message; at most 10 s and about 4 MiB",
       "application/octet-stream",
       {{"from_s", false}, {"seconds", false}}},
      {"/api/v1/takes/{name}/export",
       "get",
       "exportTake",
       "starts an export, or says how it goes: state, progress, fault, file; the options are those of mocapctl take "
       "export",
       "application/json",
       {{"format", true},
        {"axes", false},
        {"unit", false},
        {"names", false},
        {"fps", false},
        {"fill", false},
        {"subject", false}}},
      {"/api/v1/takes/{name}/edit",
       "post",
       "editTake",
       "role operator: notes, rating, tags, slate, number",
       "application/json",
       {}},
      {"/api/v1/takes/{name}/rename", "post", "renameTake", "role operator: name", "application/json", {}},
      {"/api/v1/takes/{name}/delete", "post", "deleteTake", "role operator: deletes the file", "application/json", {}},
      {"/takes/{file}",
       "get",
       "takeFile",
       "NAME.mcap: the take; NAME.FORMAT: its export, with the options of exportTake",
       "application/octet-stream",
       {}},
  };
  return kAll;
}

json parameter(const std::string& name, const char* place, bool needed) {
  return {{"name", name}, {"in", place}, {"required", needed}, {"schema", {{"type", "string"}}}};
}

json body_of(const OwnMethod& own) {
  const bool is_file = std::string_view(own.body) != "application/json";
  return {{"schema", is_file ? json{{"type", "string"}, {"format", "binary"}} : json{{"type", "object"}}}};
}

json operation_of(const OwnMethod& own, Schemas& schemas) {
  json answered = answers(schemas);
  answered["200"] = {{"description", "done"}, {"content", {{own.type, json::object()}}}};
  json operation{{"operationId", own.id}, {"summary", own.summary}, {"responses", std::move(answered)}};
  json parameters = json::array();
  const std::string path = own.path;
  if (const std::size_t open = path.find('{'); open != std::string::npos)
    parameters.push_back(parameter(path.substr(open + 1, path.find('}') - open - 1), "path", true));
  for (const auto& [name, needed] : own.query) parameters.push_back(parameter(name, "query", needed));
  if (!parameters.empty()) operation["parameters"] = std::move(parameters);
  if (std::string_view(own.method) == "post") operation["requestBody"] = {{"content", {{own.body, body_of(own)}}}};
  return {{own.method, std::move(operation)}};
}

}  // namespace

std::string openapi_json() {
  Schemas schemas;
  json paths = json::object();
  for (const Method& method : methods()) paths[std::string(kApiPath) + method.name] = operation_of(method, schemas);
  for (const OwnMethod& own : own_methods()) paths[own.path] = operation_of(own, schemas);
  const json all{
      {"openapi", "3.0.3"},
      {"info", {{"title", "mocapd: the control protocol as JSON, preflight and takes"}, {"version", "1"}}},
      {"security", json::array({json::object(), {{"token", json::array()}}})},
      {"paths", std::move(paths)},
      {"components",
       {{"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}, {"schemas", schemas.take()}}}};
  return all.dump();
}

}  // namespace mocap::web
