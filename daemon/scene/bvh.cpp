#include "scene/bvh.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace mocap::scene {
namespace {

constexpr std::size_t kMaxJoints = 512;
constexpr std::size_t kMaxValues = 100'000'000;

constexpr std::array<std::pair<std::string_view, BvhChannel>, 6> kChannels{{{"Xposition", BvhChannel::XPosition},
                                                                            {"Yposition", BvhChannel::YPosition},
                                                                            {"Zposition", BvhChannel::ZPosition},
                                                                            {"Xrotation", BvhChannel::XRotation},
                                                                            {"Yrotation", BvhChannel::YRotation},
                                                                            {"Zrotation", BvhChannel::ZRotation}}};

/// Words of a text, and the line each stands in.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}

  std::string_view next() {
    std::size_t skip = 0;
    while (skip < rest_.size() && is_space(rest_[skip])) line_ += rest_[skip++] == '\n' ? 1U : 0U;
    rest_.remove_prefix(skip);
    std::size_t length = 0;
    while (length < rest_.size() && !is_space(rest_[length])) ++length;
    const std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return word;
  }
  std::string_view rest_of_line() {
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end);
    while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
    while (!line.empty() && is_space(line.back())) line.remove_suffix(1);
    return line;
  }
  std::optional<double> number() {
    const std::string_view word = next();
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
    return value;
  }
  Error fault(std::string_view what) const {
    return {ErrorCode::InvalidArgument, "BVH line " + std::to_string(line_) + ": " + std::string(what)};
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  std::string_view rest_;
  std::size_t line_ = 1;
};

/// Reads the tree of joints.
class Hierarchy {
 public:
  Hierarchy(Words& words, Bvh& bvh) : words_(words), bvh_(bvh) {}

  Status read() {
    if (words_.next() != "HIERARCHY") return words_.fault("expected HIERARCHY");
    if (words_.next() != "ROOT") return words_.fault("expected ROOT");
    add_joint();
    while (!open_.empty() || bvh_.joints.size() == 1) {
      const std::string_view word = words_.next();
      if (word == "}") {
        if (open_.empty()) return words_.fault("'}' without '{'");
        open_.pop_back();
        if (open_.empty()) break;
        current_ = open_.back();
      } else if (const auto done = read_item(word); !done) {
        return done;
      }
    }
    return {};
  }

 private:
  static constexpr int kEnd = -2;  // an end site: a place, but no joint

  void add_joint() {
    BvhJoint joint;
    joint.name = words_.rest_of_line();
    joint.parent = open_.empty() ? -1 : open_.back();
    bvh_.joints.push_back(std::move(joint));
    current_ = static_cast<int>(bvh_.joints.size()) - 1;
  }

  Status read_item(std::string_view word) {
    if (word == "{") {
      open_.push_back(current_);
    } else if (word == "JOINT") {
      if (open_.empty() || open_.back() == kEnd) return words_.fault("a JOINT outside of a joint");
      if (bvh_.joints.size() == kMaxJoints) return words_.fault("more than 512 joints");
      add_joint();
    } else if (word == "End") {
      words_.rest_of_line();
      current_ = kEnd;
    } else if (word == "OFFSET") {
      const auto x = words_.number(), y = words_.number(), z = words_.number();
      if (!x || !y || !z) return words_.fault("expected three numbers after OFFSET");
      if (current_ != kEnd) bvh_.joints[static_cast<std::size_t>(current_)].offset = {*x, *y, *z};
    } else if (word == "CHANNELS") {
      return read_channels();
    } else {
      return words_.fault("expected '{', '}', JOINT, End Site, OFFSET or CHANNELS, found '" +
                          std::string(word.substr(0, 40)) + "'");
    }
    return {};
  }

  Status read_channels() {
    const auto count = words_.number();
    if (!count || *count < 0 || *count > 6 || current_ == kEnd)
      return words_.fault("expected 0 to 6 channels of a joint");
    BvhJoint& joint = bvh_.joints[static_cast<std::size_t>(current_)];
    joint.first_value = bvh_.values_a_frame;
    for (int i = 0; i < static_cast<int>(*count); ++i) {
      const std::string_view word = words_.next();
      const auto* known = std::ranges::find(kChannels, word, &std::pair<std::string_view, BvhChannel>::first);
      if (known == kChannels.end()) return words_.fault("unknown channel '" + std::string(word.substr(0, 40)) + "'");
      joint.channels.push_back(known->second);
    }
    bvh_.values_a_frame += joint.channels.size();
    return {};
  }

  Words& words_;
  Bvh& bvh_;
  std::vector<int> open_;
  int current_ = 0;
};

Status read_motion(Words& words, Bvh& bvh) {
  if (words.next() != "MOTION") return words.fault("expected MOTION");
  if (words.next() != "Frames:") return words.fault("expected 'Frames:'");
  const auto frames = words.number();
  if (!frames || *frames < 1 || *frames * static_cast<double>(bvh.values_a_frame) > kMaxValues) {
    return words.fault("expected a number of frames from 1 on");
  }
  if (words.next() != "Frame" || words.next() != "Time:") return words.fault("expected 'Frame Time:'");
  const auto frame_time_s = words.number();
  if (!frame_time_s || !(*frame_time_s > 0.0)) return words.fault("expected a frame time over 0 s");
  bvh.frames = static_cast<std::size_t>(*frames);
  bvh.frame_time_s = *frame_time_s;
  for (std::size_t i = 0; i < bvh.frames * bvh.values_a_frame; ++i) {
    const auto value = words.number();
    if (!value) return words.fault("expected a number: a frame is short, or a word is none");
    bvh.values.push_back(*value);
  }
  return {};
}

Eigen::Quaterniond turn_of(const BvhJoint& joint, const double* values) {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < joint.channels.size(); ++i) {
    const int axis = static_cast<int>(joint.channels[i]) - static_cast<int>(BvhChannel::XRotation);
    if (axis < 0) continue;
    turn = turn * Eigen::AngleAxisd(values[i] * std::numbers::pi / 180.0, Eigen::Vector3d::Unit(axis));
  }
  return turn;
}

Eigen::Vector3d place_of(const BvhJoint& root, const double* values) {
  Eigen::Vector3d place = root.offset;
  for (std::size_t i = 0; i < root.channels.size(); ++i) {
    const int axis = static_cast<int>(root.channels[i]);
    if (axis < 3) place[axis] = values[i];
  }
  return place;
}

}  // namespace

Result<Bvh> parse_bvh(std::string_view text) {
  Words words(text);
  Bvh bvh;
  if (const auto tree = Hierarchy(words, bvh).read(); !tree) return tree.error();
  if (bvh.values_a_frame == 0) return words.fault("no joint has a channel");
  if (const auto motion = read_motion(words, bvh); !motion) return motion.error();
  return bvh;
}

void posture_of(const Bvh& bvh, double t_s, BvhPosture& into) {
  const double at = std::clamp(t_s / bvh.frame_time_s, 0.0, static_cast<double>(bvh.frames - 1));
  const auto first = static_cast<std::size_t>(at);
  const std::size_t second = std::min(first + 1, bvh.frames - 1);
  const double share = at - static_cast<double>(first);
  const double* before = bvh.values.data() + first * bvh.values_a_frame;
  const double* after = bvh.values.data() + second * bvh.values_a_frame;
  into.root = (1.0 - share) * place_of(bvh.joints[0], before) + share * place_of(bvh.joints[0], after);
  into.turns.resize(bvh.joints.size());
  for (std::size_t i = 0; i < bvh.joints.size(); ++i) {
    const BvhJoint& joint = bvh.joints[i];
    into.turns[i] = turn_of(joint, before + joint.first_value).slerp(share, turn_of(joint, after + joint.first_value));
  }
}

}  // namespace mocap::scene
