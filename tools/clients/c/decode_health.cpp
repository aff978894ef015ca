#include <limits>

#include "decode.h"
#include "decode_parts.h"

namespace mocap::client {
namespace {

constexpr std::size_t kMaxStages = 64;
constexpr std::size_t kMaxRecordings = 1024;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

mocap_camera_health unknown_camera() {
  mocap_camera_health camera{};
  camera.name = camera.last_error = "";
  camera.phase = MOCAP_CAMERA_STARTING;
  camera.synchronised = camera.bumped = -1;
  for (double* value :
       {&camera.threshold_grey, &camera.noise_grey, &camera.background_grey, &camera.offset_us, &camera.drift_us_s,
        &camera.jitter_us, &camera.rig_off_px, &camera.rig_turned_rad, &camera.rig_moved_m})
    *value = kUnknown;
  return camera;
}

// Tags are those of message CameraHealth in health.proto.
mocap_camera_health read_camera(pbf_reader from, Health& all) {
  mocap_camera_health camera = unknown_camera();
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): camera.name = keep_text(from, all.texts); break;
      case whole(2): camera.phase = from.get_enum(); break;
      case real(3): camera.rate_hz = finite_or_nan(from.get_double()); break;
      case whole(4): camera.frames = from.get_uint64(); break;
      case whole(5): camera.missing_frames = from.get_uint64(); break;
      case whole(6): camera.failed_frames = from.get_uint64(); break;
      case whole(7): camera.dropped_queue_full = from.get_uint64(); break;
      case whole(8): camera.dropped_blobs = from.get_uint64(); break;
      case whole(9): camera.reopened = from.get_uint64(); break;
      case part(10): camera.last_error = keep_text(from, all.texts); break;
      case whole(11): camera.underruns = from.get_uint64(); break;
      case whole(12): camera.resent_packets = from.get_uint64(); break;
      case whole(13): camera.missing_packets = from.get_uint64(); break;
      case whole(14): camera.blobs = from.get_uint64(); break;
      case whole(15): camera.blobs_too_small = from.get_uint64(); break;
      case whole(16): camera.blobs_too_large = from.get_uint64(); break;
      case whole(17): camera.blobs_not_round = from.get_uint64(); break;
      case whole(18): camera.blobs_too_dim = from.get_uint64(); break;
      case whole(19): camera.rows_given_up = from.get_uint64(); break;
      case real(20): camera.threshold_grey = finite_or_nan(from.get_double()); break;
      case real(21): camera.noise_grey = finite_or_nan(from.get_double()); break;
      case real(22): camera.background_grey = finite_or_nan(from.get_double()); break;
      case whole(23): camera.synchronised = from.get_bool() ? 1 : 0; break;
      case real(24): camera.offset_us = finite_or_nan(from.get_double()); break;
      case real(25): camera.drift_us_s = finite_or_nan(from.get_double()); break;
      case real(26): camera.jitter_us = finite_or_nan(from.get_double()); break;
      case whole(27): camera.repeated_frames = from.get_uint64(); break;
      case whole(28): camera.clock_leaps = from.get_uint64(); break;
      case real(29): camera.clock_uncertainty_us = finite_or_nan(from.get_double()); break;
      case whole(30): camera.bumped = from.get_bool() ? 1 : 0; break;
      case real(31): camera.rig_off_px = finite_or_nan(from.get_double()); break;
      case real(32): camera.rig_turned_rad = finite_or_nan(from.get_double()); break;
      case real(33): camera.rig_moved_m = finite_or_nan(from.get_double()); break;
      case whole(34): camera.clock_source = from.get_enum(); break;
      case whole(35): camera.chunk_times = from.get_bool() ? 1 : 0; break;
      default: from.skip();
    }
  }
  return camera;
}

mocap_latency read_latency(pbf_reader from) {
  mocap_latency latency{};
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): latency.stage = from.get_enum(); break;
      case whole(2): latency.count = from.get_uint64(); break;
      case whole(3): latency.p50_ns = from.get_int64(); break;
      case whole(4): latency.p99_ns = from.get_int64(); break;
      case whole(5): latency.max_ns = from.get_int64(); break;
      default: from.skip();
    }
  }
  return latency;
}

mocap_recording read_recording(pbf_reader from, Health& all) {
  mocap_recording recording{"", "", MOCAP_RECORDING_RUNS, 0, 0};
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): recording.path = keep_text(from, all.texts); break;
      case whole(2): recording.state = from.get_enum(); break;
      case whole(3): recording.size_bytes = from.get_uint64(); break;
      case whole(4): recording.records = from.get_uint64(); break;
      case part(5): recording.error = keep_text(from, all.texts); break;
      default: from.skip();
    }
  }
  return recording;
}

void read_feed(pbf_reader from, mocap_health_info& info) {
  info.has_feed = 1;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): info.listeners = from.get_uint32(); break;
      case whole(2): info.connections = from.get_uint64(); break;
      case whole(3): info.disconnections = from.get_uint64(); break;
      case whole(4): info.failed_handshakes = from.get_uint64(); break;
      case whole(5): info.refused_clients = from.get_uint64(); break;
      case whole(6): info.cut_off = from.get_uint64(); break;
      case whole(7): info.subscriptions = from.get_uint32(); break;
      case whole(8): info.failed_accepts = from.get_uint64(); break;
      case whole(9): info.behind = from.get_uint32(); break;
      default: from.skip();
    }
  }
}

std::string read_search(pbf_reader from) {
  std::string sentence;
  while (from.next(12, protozero::pbf_wire_type::length_delimited)) sentence = from.get_string();
  return sentence;
}

template <typename Entry>
void add(std::vector<Entry>& into, std::size_t bound, const Entry& entry) {
  if (into.size() == bound) throw Fault{"more entries of a health report than the limit"};
  into.push_back(entry);
}

}  // namespace

void read_health(pbf_reader from, Health& into) {
  mocap_health_info& info = into.info;
  info.utc_minus_host_ns = MOCAP_ABSENT;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): info.at_ns = from.get_int64(); break;
      case whole(2): info.utc_minus_host_ns = from.get_int64(); break;
      case real(3): info.set_rate_hz = finite_or_nan(from.get_double()); break;
      case whole(4): info.sets = from.get_uint64(); break;
      case whole(5): info.complete_sets = from.get_uint64(); break;
      case whole(6): info.passed_over_sets = from.get_uint64(); break;
      case whole(7): info.dropped_snapshots = from.get_uint64(); break;
      case whole(8): info.passed_over_snapshots = from.get_uint64(); break;
      case whole(9): info.sent_snapshots = from.get_uint64(); break;
      case part(10): add(into.latencies, kMaxStages, read_latency(from.get_message())); break;
      case part(11): add(into.cameras, kMaxCameras, read_camera(from.get_message(), into)); break;
      case part(12): read_feed(from.get_message(), info); break;
      case part(13): add(into.recordings, kMaxRecordings, read_recording(from.get_message(), into)); break;
      case part(14): add(into.searches, kMaxSubjects, read_search(from.get_message())); break;
      default: from.skip();
    }
  }
  info.camera_count = into.cameras.size();
  info.latency_count = into.latencies.size();
  info.recording_count = into.recordings.size();
}

const char* decode_health(std::string_view bytes, Health& into) {
  return guarded(bytes, into, [](pbf_reader from, Health& health) { read_health(from, health); });
}

}  // namespace mocap::client
