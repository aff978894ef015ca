#include "export/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "export/clip/clip_timecode.h"
#include "export/clip/in_axes.h"
#include "export/labels.h"
#include "model/clock/timecode.h"

namespace mocap::exports {
namespace {

// A cell in quotes if it has a comma, a quote or a line break.
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string csv_header(const Clip& clip, const WriteOptions& options) {
  const std::string_view unit = name_of(options.unit);
  std::string text = "frame,time_s";
  if (clip.first_timecode) text += ",timecode";
  const auto add = [&](const std::string& name, const std::string& column) { text += ',' + cell(name + column); };
  for (const ClipSubject& subject : clip.subjects) {
    const std::string prefix = prefix_of(clip, subject);
    for (const MarkerOnBone& marker : subject.subject.marker_set.markers) {
      for (const char* axis : {"x", "y", "z"}) add(prefix + marker.name, fmt::format(".{}_{}", axis, unit));
      add(prefix + marker.name, ".state");
      add(prefix + marker.name, fmt::format(".residual_{}", unit));
    }
    for (const std::string& bone : bone_names(subject.subject.marker_set.skeleton, options.names)) {
      for (const char* axis : {"x", "y", "z"}) add(prefix + "bone:" + bone, fmt::format(".{}_{}", axis, unit));
      for (const char* column : {".qx", ".qy", ".qz", ".qw", ".state"}) add(prefix + "bone:" + bone, column);
    }
  }
  return text + '\n';
}

void append_position(std::string& text, const Eigen::Vector3d& at_m, const WriteOptions& options) {
  const Eigen::Vector3d at = per_metre(options.unit) * in_axes(at_m, options.axes);
  const int decimals = decimals_of(options.unit);
  fmt::format_to(std::back_inserter(text), ",{:.{}f},{:.{}f},{:.{}f}", at.x(), decimals, at.y(), decimals, at.z(),
                 decimals);
}

void append_marker(std::string& text, const MarkerSample& marker, const WriteOptions& options) {
  if (marker.state == LabelState::Lost) {
    text += ",,,,lost,";
    return;
  }
  append_position(text, marker.position_m, options);
  const bool measured = marker.state == LabelState::Measured;
  text += measured ? ",measured," : ",filled,";
  if (measured && marker.residual_m > 0.0F) {
    fmt::format_to(std::back_inserter(text), "{:.{}f}", per_metre(options.unit) * marker.residual_m,
                   decimals_of(options.unit));
  }
}

// A bone whose parent is lost has no place in the world.
void append_bones(std::string& text, const ClipSubject& subject, std::size_t frame, const WriteOptions& options) {
  const auto& bones = subject.subject.marker_set.skeleton.bones;
  std::vector<Pose> world_from_bone(bones.size());
  std::vector<bool> known(bones.size());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const BoneSample& sample = subject.bones[frame * bones.size() + b];
    const auto parent = static_cast<std::size_t>(std::max(bones[b].parent, 0));
    const bool root = bones[b].parent < 0;
    known[b] = sample.state != BoneState::Lost && (root || known[parent]);
    if (!known[b]) {
      text += ",,,,,,,,lost";
      continue;
    }
    world_from_bone[b] = root ? sample.parent_from_bone : world_from_bone[parent] * sample.parent_from_bone;
    append_position(text, world_from_bone[b].position, options);
    const Eigen::Quaterniond q = in_axes(world_from_bone[b].rotation, options.axes);
    fmt::format_to(std::back_inserter(text), ",{:.7f},{:.7f},{:.7f},{:.7f},{}", q.x(), q.y(), q.z(), q.w(),
                   sample.state == BoneState::Measured ? "measured" : "filled");
  }
}

void append_csv_row(std::string& text, const Clip& clip, std::size_t frame, const WriteOptions& options) {
  const double time_s = clip.rate.time_s(static_cast<std::int64_t>(frame));
  fmt::format_to(std::back_inserter(text), "{},{:.9f}", clip.first_frame + static_cast<std::int64_t>(frame), time_s);
  if (clip.first_timecode) text += ',' + text_of(timecode_at(clip, time_s));
  for (const ClipSubject& subject : clip.subjects) {
    const std::size_t markers = subject.subject.marker_set.markers.size();
    for (std::size_t m = 0; m < markers; ++m) append_marker(text, subject.markers[frame * markers + m], options);
    append_bones(text, subject, frame, options);
  }
  text += '\n';
}

}  // namespace

Status write_csv(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  BufferedSink out(sink);
  out.text() = csv_header(clip, options);
  for (std::size_t frame = 0; frame < clip.frames; ++frame) {
    append_csv_row(out.text(), clip, frame, options);
    if (const Status passed = out.pass_on(); !passed) return passed;
  }
  return out.finish();
}

}  // namespace mocap::exports
