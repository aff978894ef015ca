#include <limits>

#include "decode.h"
#include "decode_parts.h"

namespace mocap::client {
namespace {

constexpr float kPercent = 100.0F;
constexpr float kMilli = 1000.0F;
constexpr std::int64_t kMaxInstant_ns =
    3'000'000'000'000'000'000;  // UTC in 2065; the sum of three such values does not overflow

// The number of rows of a set of columns. The first column determines the number; all other columns must have the same
// number.
struct Rows {
  std::size_t count = 0;
  bool known = false;
  void expect(std::size_t things, std::size_t bound) {
    if (things > bound) throw Fault{"more rows than the limit"};
    if (known && things != count) throw Fault{"columns differ in length"};
    known = true;
    count = things;
  }
};

template <typename Thing>
void expect(Rows& rows, std::vector<Thing>& things, std::size_t count, std::size_t bound) {
  rows.expect(count, bound);
  if (things.size() < count) things.resize(count);
}

// Reads a column of floats with `width` floats in each row.
template <typename Thing, typename Put>
void floats(pbf_reader& from, Rows& rows, std::vector<Thing>& things, std::size_t width, std::size_t bound, Put put) {
  const auto column = from.get_packed_float();
  const std::size_t numbers = column.size();
  if (numbers % width != 0) throw Fault{"a column with an incomplete vector"};
  expect(rows, things, numbers / width, bound);
  float values[4] = {};
  std::size_t i = 0;
  for (const float value : column) {
    values[i % width] = finite(static_cast<double>(value));
    if (++i % width == 0) put(things[i / width - 1], values);
  }
}

// Reads a column of integers with one integer in each row.
template <typename Thing, typename Put>
void wholes(pbf_reader& from, Rows& rows, std::vector<Thing>& things, std::size_t bound, Put put) {
  const auto column = from.get_packed_uint32();
  std::size_t count = 0;
  for (auto at = column.begin(); at != column.end(); ++at) {
    if (++count > bound) throw Fault{"more rows than the limit"};
  }
  expect(rows, things, count, bound);
  std::size_t i = 0;
  for (const std::uint32_t value : column) put(things[i++], value);
}

// Protobuf omits only empty columns, so a required column must be present if there are rows.
void want(bool there) {
  if (!there) throw Fault{"a column is missing"};
}

mocap_vec3 vec3(const float* v) { return {v[0], v[1], v[2]}; }
mocap_quat quat(const float* v) { return {v[0], v[1], v[2], v[3]}; }

mocap_quat unit(mocap_quat q) {
  const float norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (!(norm > 0.9F && norm < 1.1F)) throw Fault{"a rotation that is not a unit quaternion"};
  return {q.x / norm, q.y / norm, q.z / norm, q.w / norm};
}

std::int32_t state_of(std::uint32_t code) {
  return code == MOCAP_STATE_MEASURED || code == MOCAP_STATE_FILLED ? static_cast<std::int32_t>(code)
                                                                    : MOCAP_STATE_LOST;
}

std::int64_t instant(pbf_reader& from) {
  const std::int64_t ns = from.get_int64();
  if (ns < -kMaxInstant_ns || ns > kMaxInstant_ns) throw Fault{"an instant out of range"};
  return ns;
}

void read_instants(pbf_reader from, mocap_frame_info& into) {
  into.exposed_at_ns = 0;  // Protobuf omits this instant if it is 0
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): into.exposed_at_ns = instant(from); break;
      case whole(2): into.received_at_ns = instant(from); break;
      case whole(3): into.detected_at_ns = instant(from); break;
      case whole(4): into.fused_at_ns = instant(from); break;
      case whole(5): into.sent_at_ns = instant(from); break;
      default: from.skip();
    }
  }
}

std::uint32_t count_views(pbf_reader from) {
  std::uint32_t cameras = 0;
  while (from.next()) {
    if (from.tag_and_type() != part(1)) {
      from.skip();
      continue;
    }
    const auto column = from.get_packed_uint32();
    for (auto at = column.begin(); at != column.end(); ++at) {
      if (++cameras > kMaxCameras) throw Fault{"more cameras than the limit"};
    }
  }
  return cameras;
}

void read_timecode(pbf_reader from, mocap_frame_info& into) {
  const auto small = [&from] { return static_cast<std::uint8_t>(from.get_uint32() & 0xFFU); };
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): into.timecode_hours = small(); break;
      case whole(2): into.timecode_minutes = small(); break;
      case whole(3): into.timecode_seconds = small(); break;
      case whole(4): into.timecode_frames = small(); break;
      case whole(5): into.timecode_rate = from.get_uint32(); break;
      case whole(6): into.timecode_drop_frame = from.get_bool() ? 1 : 0; break;
      case whole(7): into.timecode_subframe = from.get_uint32(); break;
      default: from.skip();
    }
  }
}

void read_markers(pbf_reader from, std::vector<mocap_marker_pose>& into) {
  into.clear();
  Rows rows;
  bool stated = false;
  bool placed = false;
  using Marker = mocap_marker_pose;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1):
        wholes(from, rows, into, kMaxMarkers, [](Marker& m, std::uint32_t v) { m.state = state_of(v); });
        stated = true;
        break;
      case part(2):
        floats(from, rows, into, 3, kMaxMarkers, [](Marker& m, const float* v) { m.position = vec3(v); });
        placed = true;
        break;
      case part(4): wholes(from, rows, into, kMaxMarkers, [](Marker& m, std::uint32_t v) { m.cameras = v; }); break;
      case part(5):
        wholes(from, rows, into, kMaxMarkers,
               [](Marker& m, std::uint32_t v) { m.confidence = static_cast<float>(v) / kPercent; });
        break;
      case part(6): wholes(from, rows, into, kMaxMarkers, [](Marker& m, std::uint32_t v) { m.track = v; }); break;
      case part(7):
        wholes(from, rows, into, kMaxMarkers,
               [](Marker& m, std::uint32_t v) { m.residual_px = static_cast<float>(v) / kMilli; });
        break;
      default: from.skip();
    }
  }
  want((stated && placed) || !rows.known);
}

void read_bones(pbf_reader from, SubjectFrame& subject) {
  std::vector<mocap_bone_pose>& into = subject.bones;
  into.clear();
  Rows rows;
  bool stated = false;
  bool placed = false;
  bool turned = false;
  using Bone = mocap_bone_pose;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1):
        wholes(from, rows, into, kMaxBones, [](Bone& b, std::uint32_t v) { b.state = state_of(v); });
        stated = true;
        break;
      case part(2):
        floats(from, rows, into, 3, kMaxBones, [](Bone& b, const float* v) { b.position = vec3(v); });
        placed = true;
        break;
      case part(3):
        floats(from, rows, into, 4, kMaxBones, [](Bone& b, const float* v) { b.rotation = unit(quat(v)); });
        turned = true;
        break;
      case part(4):
        floats(from, rows, into, 3, kMaxBones, [](Bone& b, const float* v) { b.local_position = vec3(v); });
        subject.has_local_positions = true;
        break;
      case part(5):
        floats(from, rows, into, 4, kMaxBones, [](Bone& b, const float* v) { b.local_rotation = unit(quat(v)); });
        subject.has_local_rotations = true;
        break;
      case part(6):
        wholes(from, rows, into, kMaxBones,
               [](Bone& b, std::uint32_t v) { b.confidence = static_cast<float>(v) / kPercent; });
        break;
      case part(7):
        floats(from, rows, into, 3, kMaxBones, [](Bone& b, const float* v) { b.velocity = vec3(v); });
        break;
      case part(8): floats(from, rows, into, 3, kMaxBones, [](Bone& b, const float* v) { b.spin = vec3(v); }); break;
      default: from.skip();
    }
  }
  want((stated && placed && turned) || !rows.known);
}

void read_subject(pbf_reader from, SubjectFrame& into) {
  into.subject = 0;
  into.phase = MOCAP_PHASE_SEARCHING;
  into.residual_m = std::numeric_limits<float>::quiet_NaN();
  into.smoothing_delay_s = 0.0F;
  into.has_local_positions = into.has_local_rotations = false;
  into.bones.clear();
  into.markers.clear();
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): into.subject = from.get_uint32(); break;
      case whole(2): {
        const std::int32_t code = from.get_enum();
        into.phase = code == MOCAP_PHASE_TRACKING || code == MOCAP_PHASE_LOST ? code : MOCAP_PHASE_SEARCHING;
        break;
      }
      case part(3): read_markers(from.get_message(), into.markers); break;
      case part(4): read_bones(from.get_message(), into); break;
      case single(5): into.residual_m = finite(static_cast<double>(from.get_float())); break;
      case single(6): into.smoothing_delay_s = finite(static_cast<double>(from.get_float())); break;
      default: from.skip();
    }
  }
}

void read_points(pbf_reader from, std::vector<mocap_point>& into) {
  into.clear();
  Rows rows;
  bool placed = false;
  using Point = mocap_point;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): wholes(from, rows, into, kMaxMarkers, [](Point& p, std::uint32_t v) { p.track = v; }); break;
      case part(2):
        floats(from, rows, into, 3, kMaxMarkers, [](Point& p, const float* v) { p.position = vec3(v); });
        placed = true;
        break;
      case part(4): wholes(from, rows, into, kMaxMarkers, [](Point& p, std::uint32_t v) { p.cameras = v; }); break;
      case part(5):
        wholes(from, rows, into, kMaxMarkers,
               [](Point& p, std::uint32_t v) { p.residual_px = static_cast<float>(v) / kMilli; });
        break;
      default: from.skip();
    }
  }
  want(placed || !rows.known);
}

void read_snapshot(pbf_reader from, Frame& into) {
  into.info = {};
  mocap_frame_info& info = into.info;
  info.exposed_at_ns = info.received_at_ns = info.detected_at_ns = info.fused_at_ns = info.sent_at_ns = MOCAP_ABSENT;
  info.utc_minus_host_ns = MOCAP_ABSENT;
  into.points.clear();
  std::size_t subjects = 0;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): info.number = from.get_uint64(); break;
      case whole(2): info.sequence = from.get_uint64(); break;
      case whole(3): info.description_version = from.get_uint32(); break;
      case part(4): read_instants(from.get_message(), info); break;
      case whole(5): info.utc_minus_host_ns = instant(from); break;
      case whole(6): info.expected_cameras = from.get_uint32(); break;
      case part(7): info.cameras = count_views(from.get_message()); break;
      case part(8):
        if (++subjects > kMaxSubjects) throw Fault{"more subjects than the limit"};
        if (into.subjects.size() < subjects) into.subjects.resize(subjects);
        read_subject(from.get_message(), into.subjects[subjects - 1]);
        break;
      case part(9): read_points(from.get_message(), into.points); break;
      case whole(10):
        info.synchronised = static_cast<std::uint32_t>(from.get_enum());
        if (info.synchronised > 2) info.synchronised = 0;
        break;
      case part(11): read_timecode(from.get_message(), info); break;
      default: from.skip();
    }
  }
  into.subjects.resize(subjects);
  info.subject_count = static_cast<std::uint32_t>(subjects);
  info.point_count = static_cast<std::uint32_t>(into.points.size());
}

}  // namespace

const char* decode_snapshot(std::string_view bytes, Frame& into) {
  return guarded(bytes, into, [](pbf_reader from, Frame& frame) { read_snapshot(from, frame); });
}

}  // namespace mocap::client
