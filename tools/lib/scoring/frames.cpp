#include "lib/scoring/frames.h"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>

#include "wire/codec/decode.h"
#include "wire/codec/json.h"

namespace mocap::scoring {
namespace {

Result<EvalFrame> read_line(const std::string& line) {
  const Result<v1::Snapshot> message = wire::message_from_json_line(line);
  if (!message) return message.error();
  const Result<Snapshot> snapshot = wire::decode(*message);
  if (!snapshot) return snapshot.error();
  EvalFrame frame = frame_of(*snapshot);
  if (message->has_sequence()) frame.number = message->sequence();
  return frame;
}

Result<std::vector<EvalFrame>> read_stream(std::istream& in, const std::string& name) {
  std::vector<EvalFrame> frames;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const bool cut_off = in.eof();  // the last line lacks its newline
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Result<EvalFrame> frame = read_line(line);
    if (frame) {
      frames.push_back(std::move(*frame));
    } else if (!cut_off || frames.empty()) {
      return Error{ErrorCode::InvalidArgument, fmt::format("{}:{}: {}", name, number, frame.error().message)};
    }
  }
  if (in.bad()) return Error{ErrorCode::Io, fmt::format("{}: cannot be read: {}", name, std::strerror(errno))};
  return frames;
}

}  // namespace

EvalFrame frame_of(const Snapshot& snapshot) {
  EvalFrame frame;
  frame.number = snapshot.number;
  frame.exposed_at = snapshot.instants.exposed_at;
  frame.views = static_cast<std::uint32_t>(snapshot.views.size());
  frame.expected_views = snapshot.expected_views;
  for (const SubjectLabels& labels : snapshot.labels) {
    std::uint32_t index = 0;
    for (const LabelledMarker& marker : labels.markers) {
      if (marker.state != LabelState::Lost) {
        frame.markers.push_back({labels.subject.value, index, marker.state, marker.position.v, marker.cameras});
      }
      ++index;
    }
    frame.subjects.push_back({labels.subject.value, labels.phase, false});
  }
  for (const SubjectPose& pose : snapshot.poses) {
    std::uint32_t index = 0;
    for (const BonePose& bone : pose.bones) {
      if (bone.state != BoneState::Lost) {
        frame.bones.push_back(
            {pose.subject.value, index, bone.state, bone.world_from_bone.position, bone.world_from_bone.rotation});
      }
      ++index;
    }
    const bool whole = !pose.bones.empty() && std::ranges::none_of(pose.bones, [](const BonePose& bone) {
      return bone.state == BoneState::Lost;
    });
    for (SubjectSaid& subject : frame.subjects) subject.whole |= subject.subject == pose.subject.value && whole;
  }
  for (const UnlabelledMarker& marker : snapshot.unlabelled) frame.unlabelled_m.push_back(marker.position.v);
  return frame;
}

Result<std::vector<EvalFrame>> read_frames(const std::string& path) {
  if (path == "-") return read_stream(std::cin, "standard input");
  std::ifstream in(path);
  if (!in) return Error{ErrorCode::NotFound, fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
  return read_stream(in, path);
}

}  // namespace mocap::scoring
