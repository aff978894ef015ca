#include "cameras/aravis/aravis_failure.h"

#include <fmt/format.h>
// Aravis's C headers do not keep our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

namespace mocap::cameras {
namespace {

ErrorCode code_of(const GError* error) {
  if (error == nullptr || error->domain != ARV_DEVICE_ERROR) return ErrorCode::Io;
  switch (error->code) {
    case ARV_DEVICE_ERROR_NOT_FOUND: return ErrorCode::NotFound;
    case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND:
    case ARV_DEVICE_ERROR_WRONG_FEATURE: return ErrorCode::Unsupported;
    case ARV_DEVICE_ERROR_NOT_CONTROLLER:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY: return ErrorCode::Busy;
    default: return ErrorCode::Io;
  }
}

}  // namespace

AravisFailure::~AravisFailure() { g_clear_error(&error_); }

AravisFailure::operator GError**() {
  g_clear_error(&error_);
  return &error_;
}

std::string AravisFailure::text() const { return error_ != nullptr ? error_->message : "no reason given"; }

Error AravisFailure::error(std::string_view what) const {
  return {code_of(error_), fmt::format("{}: {}", what, text())};
}

}  // namespace mocap::cameras
