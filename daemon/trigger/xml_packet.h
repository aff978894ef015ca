#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "trigger/request.h"

namespace mocap::trigger {

/// Reads a packet of XML: CaptureStart, CaptureStop or CaptureComplete, StartRecordingReq or StopRecordingReq of Xsens.
/// `xsens`: CaptureStart and CaptureStop are answered as Xsens does.
///
/// Zero bytes and white space around the document are permitted. Unknown elements are left out. Fails with
/// InvalidArgument if the packet is not one complete document, has a document type or an entity of its own, is nested
/// more than 4 deep or has more than 64 elements, or if a value is wrong.
Result<Request> read_xml(std::string_view packet, bool xsens);

/// CaptureStart, CaptureStop or CaptureComplete.
struct CapturePacket {
  Verb verb = Verb::Start;  ///< no Cancel: a stop with the result CANCEL
  std::string result = {};  ///< of CaptureStop and CaptureComplete
  std::string name;
  std::string notes = {};
  std::string description = {};
  std::string database_path = {};
  Duration delay{};
  std::string packet_id = {};  ///< empty: none
};

/// One document without white space between its tokens, with a zero byte at its end.
std::string write_capture(const CapturePacket& packet);

/// The answer of Xsens to a start or a stop of the dialect CaptureAck or Recording. `reason`: why the request is
/// refused; empty: it is executed.
std::string write_ack(Verb verb, Dialect dialect, std::string_view reason);

}  // namespace mocap::trigger
