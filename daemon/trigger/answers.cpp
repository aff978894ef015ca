#include "trigger/answers.h"

#include "trigger/osc_packet.h"
#include "trigger/xml_packet.h"

namespace mocap::trigger {
namespace {

constexpr const char* kNoTimecode = "00:00:00.000";  // as Live Link Face sends it

}  // namespace

std::string folder_of(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  return std::string(slash == std::string_view::npos ? std::string_view() : path.substr(0, slash));
}

std::optional<std::string> start_answer(const Request& request, const AnsweredTake& take) {
  switch (request.dialect) {
    case Dialect::Capture:
      return write_capture({.verb = Verb::Start,
                            .name = take.name,
                            .notes = request.notes,
                            .description = request.description,
                            .database_path = folder_of(take.path),
                            .delay = request.delay,
                            .packet_id = request.packet_id});
    case Dialect::Osc: return write_osc("/RecordStartConfirm", {kNoTimecode});
    case Dialect::CaptureAck:
    case Dialect::Recording: break;
  }
  return write_ack(Verb::Start, request.dialect, {});
}

std::optional<std::string> stop_answer(const Request& request, const char* result, const AnsweredTake& take) {
  switch (request.dialect) {
    case Dialect::Capture:
      return write_capture({.verb = Verb::Stop,
                            .result = result,
                            .name = take.name,
                            .database_path = folder_of(take.path),
                            .packet_id = request.packet_id});
    case Dialect::Osc: return std::nullopt;  // the confirmation names a complete file
    case Dialect::CaptureAck:
    case Dialect::Recording: break;
  }
  return write_ack(Verb::Stop, request.dialect, {});
}

std::optional<std::string> complete_answer(const Request& request, const char* result, const AnsweredTake& take) {
  if (request.dialect == Dialect::Capture) {
    return write_capture({.verb = Verb::Complete,
                          .result = result,
                          .name = take.name,
                          .database_path = folder_of(take.path),
                          .packet_id = request.packet_id});
  }
  if (request.dialect != Dialect::Osc || request.verb == Verb::Start) return std::nullopt;
  return write_osc("/RecordStopConfirm", {kNoTimecode, take.name, take.path});
}

std::optional<std::string> refusal_answer(const Request& request, const std::string& why) {
  if (request.dialect == Dialect::Capture) {
    return write_capture(
        {.verb = Verb::Stop, .result = "FAIL", .name = request.name, .notes = why, .packet_id = request.packet_id});
  }
  if (request.dialect == Dialect::Osc) return std::nullopt;
  return write_ack(request.verb, request.dialect, why);
}

}  // namespace mocap::trigger
