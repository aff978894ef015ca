#include "decode.h"
#include "decode_parts.h"

namespace mocap::client {
namespace {

mocap_vec3 read_vector(pbf_reader from) {
  double v[3] = {};
  while (from.next()) {
    switch (from.tag_and_type()) {
      case real(1): v[0] = from.get_double(); break;
      case real(2): v[1] = from.get_double(); break;
      case real(3): v[2] = from.get_double(); break;
      default: from.skip();
    }
  }
  return {finite(v[0]), finite(v[1]), finite(v[2])};
}

std::int32_t index_below(std::uint32_t index, std::size_t count) {
  if (index >= count) throw Fault{"an index out of range"};
  return static_cast<std::int32_t>(index);
}

mocap_bone read_bone(pbf_reader from, std::size_t before, Description& into) {
  mocap_bone bone{"", "", "", "", -1, {}};
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): bone.name = keep_text(from, into.texts); break;
      case whole(2): bone.parent = index_below(from.get_uint32(), before); break;
      case part(3): bone.rest_offset = read_vector(from.get_message()); break;
      case part(7): bone.unity_name = keep_text(from, into.texts); break;
      case part(8): bone.unreal_name = keep_text(from, into.texts); break;
      case part(9): bone.vrm_name = keep_text(from, into.texts); break;
      default: from.skip();
    }
  }
  return bone;
}

mocap_marker read_marker(pbf_reader from, Description& into) {
  mocap_marker marker{"", 0, {}};
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): marker.name = keep_text(from, into.texts); break;
      case whole(2): marker.bone = index_below(from.get_uint32(), kMaxBones); break;
      case part(3): marker.offset = read_vector(from.get_message()); break;
      default: from.skip();
    }
  }
  return marker;
}

void read_subject_description(pbf_reader from, Description& all) {
  SubjectDescription& into = all.subjects.emplace_back();
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): into.name = from.get_string(); break;
      case part(2): into.marker_set = from.get_string(); break;
      case part(3): into.skeleton = from.get_string(); break;
      case part(4):
        if (into.bones.size() == kMaxBones) throw Fault{"more bones than the limit"};
        into.bones.push_back(read_bone(from.get_message(), into.bones.size(), all));
        break;
      case part(5):
        if (into.markers.size() == kMaxMarkers) throw Fault{"more markers than the limit"};
        into.markers.push_back(read_marker(from.get_message(), all));
        break;
      default: from.skip();
    }
  }
  for (const mocap_marker& marker : into.markers) {
    index_below(static_cast<std::uint32_t>(marker.bone), into.bones.size());
  }
}

std::string name_of_camera(pbf_reader from) {
  std::string name;
  while (from.next(1, protozero::pbf_wire_type::length_delimited)) name = from.get_string();
  return name;
}

void read_description(pbf_reader from, Description& into) {
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): into.protocol = from.get_string(); break;
      case whole(2): into.version = from.get_uint32(); break;
      case part(3): into.producer = from.get_string(); break;
      case part(4): into.session = from.get_string(); break;
      case real(6): into.nominal_rate_hz = from.get_double(); break;
      case part(7):
        if (into.cameras.size() == kMaxCameras) throw Fault{"more cameras than the limit"};
        into.cameras.push_back(name_of_camera(from.get_message()));
        break;
      case part(8):
        if (into.subjects.size() == kMaxSubjects) throw Fault{"more subjects than the limit"};
        read_subject_description(from.get_message(), into);
        break;
      default: from.skip();
    }
  }
  if (!std::isfinite(into.nominal_rate_hz)) into.nominal_rate_hz = 0.0;
}

}  // namespace

const char* decode_description(std::string_view bytes, Description& into) {
  return guarded(bytes, into, [](pbf_reader from, Description& description) { read_description(from, description); });
}

}  // namespace mocap::client
