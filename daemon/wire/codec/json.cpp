#include "wire/codec/json.h"

#include <google/protobuf/util/json_util.h>

#include "wire/codec/decode.h"
#include "wire/codec/encode.h"

namespace mocap::wire {

std::string to_json_line(const Snapshot& snapshot) {
  v1::Snapshot message;
  encode(snapshot, message);
  return to_json_line(message);
}

std::string to_json_line(const v1::Snapshot& message) {
  std::string line;
  const auto status = google::protobuf::util::MessageToJsonString(message, &line);
  MOCAP_EXPECTS(status.ok());  // every v1::Snapshot has a JSON form
  return line;
}

Result<v1::Snapshot> message_from_json_line(std::string_view line) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  v1::Snapshot message;
  const auto status = google::protobuf::util::JsonStringToMessage({line.data(), line.size()}, &message, options);
  if (!status.ok()) {
    return Error{ErrorCode::InvalidArgument, "not a snapshot in JSON: " + std::string(status.message())};
  }
  return message;
}

Result<Snapshot> from_json_line(std::string_view line) {
  const Result<v1::Snapshot> message = message_from_json_line(line);
  if (!message) return message.error();
  return decode(*message);
}

}  // namespace mocap::wire
