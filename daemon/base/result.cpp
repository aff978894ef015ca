#include "base/result.h"

namespace mocap {

const char* name_of(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::InvalidArgument: return "invalid argument";
    case ErrorCode::NotFound: return "not found";
    case ErrorCode::Unsupported: return "unsupported";
    case ErrorCode::Timeout: return "timeout";
    case ErrorCode::DeviceLost: return "device lost";
    case ErrorCode::Busy: return "busy";
    case ErrorCode::Io: return "input/output";
    case ErrorCode::EndOfStream: return "end of stream";
  }
  return "unknown";
}

}  // namespace mocap
