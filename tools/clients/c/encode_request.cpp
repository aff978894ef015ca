#include "encode_request.h"

#include <cmath>
#include <protozero/pbf_writer.hpp>

namespace mocap::client {
namespace {

using protozero::pbf_writer;

// Fields of message Request.
enum Field {
  kStatus = 2,
  kDescription = 3,
  kSnapshot = 4,
  kCapture = 5,
  kSubject = 6,
  kCamera = 7,
  kMask = 8,
  kReload = 9,
  kTake = 10
};

// Values of the actions.
enum Capture { kStart = 1, kStop = 2 };
enum Take { kTakeStart = 1, kTakeStop = 2, kTakeCancel = 3, kTakeMark = 4, kTakeNext = 5 };
enum Subject { kAdd = 1, kRemove = 2, kReset = 3, kFit = 4 };

std::string encode_capture(Capture action) {
  std::string bytes;
  pbf_writer(bytes).add_enum(1, action);
  return bytes;
}

std::string encode_subject(const mocap_request& request, Subject action) {
  std::string bytes;
  pbf_writer into(bytes);
  into.add_enum(1, action);
  if (request.name != nullptr) into.add_string(2, request.name);
  if (action == kAdd && request.marker_set != nullptr) into.add_string(6, request.marker_set);
  if (action != kFit) return bytes;
  if (request.rest_offsets_m != nullptr)
    into.add_packed_double(3, request.rest_offsets_m, request.rest_offsets_m + request.rest_offset_count);
  if (request.marker_offsets_m != nullptr)
    into.add_packed_double(4, request.marker_offsets_m, request.marker_offsets_m + request.marker_offset_count);
  into.add_double(5, request.residual_m);
  return bytes;
}

std::string encode_camera(const mocap_request& request) {
  std::string bytes;
  pbf_writer into(bytes);
  if (request.name != nullptr) into.add_string(1, request.name);
  if (!std::isnan(request.exposure_us)) into.add_double(2, request.exposure_us);
  if (!std::isnan(request.gain_db)) into.add_double(3, request.gain_db);
  return bytes;
}

std::string encode_mask(const mocap_request& request) {
  std::string bytes;
  pbf_writer into(bytes);
  if (request.name != nullptr) into.add_string(1, request.name);
  into.add_uint32(2, request.images);
  return bytes;
}

std::string encode_take(const mocap_request& request, Take action) {
  std::string bytes;
  pbf_writer into(bytes);
  into.add_enum(1, action);
  if (request.name != nullptr) into.add_string(2, request.name);
  if (request.slate != nullptr) into.add_string(3, request.slate);
  if (request.text != nullptr) into.add_string(4, request.text);
  into.add_double(5, request.before_s);
  into.add_double(6, request.seconds);
  into.add_double(7, request.countdown_s);
  into.add_int64(8, request.at_utc_ns);
  return bytes;
}

}  // namespace

std::string encode_request(const mocap_request& request, std::uint64_t id) {
  std::string bytes;
  pbf_writer into(bytes);
  into.add_uint64(1, id);
  switch (request.kind) {
    case MOCAP_REQUEST_STATUS: into.add_message(kStatus, std::string{}); break;
    case kDescriptionRequest: into.add_message(kDescription, std::string{}); break;
    case kSnapshotRequest: into.add_message(kSnapshot, std::string{}); break;
    case MOCAP_REQUEST_CAPTURE_START: into.add_message(kCapture, encode_capture(kStart)); break;
    case MOCAP_REQUEST_CAPTURE_STOP: into.add_message(kCapture, encode_capture(kStop)); break;
    case MOCAP_REQUEST_SUBJECT_ADD: into.add_message(kSubject, encode_subject(request, kAdd)); break;
    case MOCAP_REQUEST_SUBJECT_REMOVE: into.add_message(kSubject, encode_subject(request, kRemove)); break;
    case MOCAP_REQUEST_SUBJECT_RESET: into.add_message(kSubject, encode_subject(request, kReset)); break;
    case MOCAP_REQUEST_SUBJECT_FIT: into.add_message(kSubject, encode_subject(request, kFit)); break;
    case MOCAP_REQUEST_CAMERA_SET: into.add_message(kCamera, encode_camera(request)); break;
    case MOCAP_REQUEST_MASK_LEARN: into.add_message(kMask, encode_mask(request)); break;
    case MOCAP_REQUEST_RELOAD: into.add_message(kReload, std::string{}); break;
    case MOCAP_REQUEST_TAKE_START: into.add_message(kTake, encode_take(request, kTakeStart)); break;
    case MOCAP_REQUEST_TAKE_STOP: into.add_message(kTake, encode_take(request, kTakeStop)); break;
    case MOCAP_REQUEST_TAKE_CANCEL: into.add_message(kTake, encode_take(request, kTakeCancel)); break;
    case MOCAP_REQUEST_TAKE_MARK: into.add_message(kTake, encode_take(request, kTakeMark)); break;
    case MOCAP_REQUEST_TAKE_NEXT: into.add_message(kTake, encode_take(request, kTakeNext)); break;
    default: return {};
  }
  return bytes;
}

}  // namespace mocap::client
