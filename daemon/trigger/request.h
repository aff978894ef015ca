#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include "base/result.h"
#include "base/time.h"

namespace mocap::trigger {

/// Largest packet that is read.
inline constexpr std::size_t kMaxPacket_bytes = 8192;

enum class Verb {
  Start,
  Stop,
  Cancel,   ///< a stop whose result is CANCEL: the take is not wanted
  Complete  ///< a note that another program has written its file
};

/// How a request is answered.
enum class Dialect {
  Capture,     ///< CaptureStart, CaptureStop, CaptureComplete
  CaptureAck,  ///< CaptureStartAck, CaptureStopAck of Xsens
  Recording,   ///< StartRecordingAck, StopRecordingAck of Xsens
  Osc          ///< /RecordStartConfirm, /RecordStopConfirm
};

/// A trigger of another program. Texts are UTF-8 of at most kMaxPacket_bytes together.
struct Request {
  Verb verb = Verb::Start;
  Dialect dialect = Dialect::Capture;
  std::string name;        ///< of the take; empty: not given
  std::string slate = {};  ///< empty: not given
  std::string notes = {};
  std::string description = {};
  std::string packet_id = {};  ///< empty: not given
  std::string result = {};     ///< of a stop or a note: SUCCESS, FAIL, CANCEL; empty: not given
  Duration delay{};            ///< from the packet to the start
};

/// Why a packet is refused.
inline Error refusal(std::string why) { return {ErrorCode::InvalidArgument, std::move(why)}; }

/// "start", "stop", ...
const char* name_of(Verb verb);

}  // namespace mocap::trigger
