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

/// Splits a text into words and counts its lines.
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

/// Reads the HIERARCHY section.
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
  static constexpr int kEnd = -2;  // an end site: has an offset, but is no joint

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
      if (open_.empty() || open_.back() == kEnd) return words_.fault("JOINT outside of ROOT");
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
      return words_.fault("expected 0 to 6 channels, in a joint");
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
    return words.fault("expected a number of frames, at least 1");
  }
  if (words.next() != "Frame" || words.next() != "Time:") return words.fault("expected 'Frame Time:'");
  const auto frame_time_s = words.number();
  if (!frame_time_s || !(*frame_time_s > 0.0)) return words.fault("expected a frame time above 0 s");
  bvh.frames = static_cast<std::size_t>(*frames);
  bvh.frame_time_s = *frame_time_s;
  for (std::size_t i = 0; i < bvh.frames * bvh.values_a_frame; ++i) {
    const auto value = words.number();
    if (!value) return words.fault("expected a number: a frame is too short or has another word");
    bvh.values.push_back(*value);
  }
  return {};
}

Eigen::Quaterniond rotation_of(const BvhJoint& joint, const double* values) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < joint.channels.size(); ++i) {
    const int axis = static_cast<int>(joint.channels[i]) - static_cast<int>(BvhChannel::XRotation);
    if (axis < 0) continue;
    rotation = rotation * Eigen::AngleAxisd(values[i] * std::numbers::pi / 180.0, Eigen::Vector3d::Unit(axis));
  }
  return rotation;
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

namespace {

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  const double angle = angle_axis.angle();
  return (angle > std::numbers::pi ? angle - 2.0 * std::numbers::pi : angle) * angle_axis.axis();
}

Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 1e-12 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle)) : Eigen::Quaterniond::Identity();
}

// Catmull-Rom tangent at a frame: the mean of the displacements before and after it. At the first or last frame, the
// only displacement.
Eigen::Vector3d tangent(const Eigen::Vector3d* before, const Eigen::Vector3d* after) {
  if (before == nullptr) return *after;
  if (after == nullptr) return *before;
  return 0.5 * (*before + *after);
}

// A cubic Bezier curve from b[0] to b[3], by de Casteljau's algorithm with slerp for rotations.
Eigen::Vector3d on_curve(const std::array<Eigen::Vector3d, 4>& b, double u) {
  const double v = 1.0 - u;
  return v * v * v * b[0] + 3.0 * u * v * v * b[1] + 3.0 * u * u * v * b[2] + u * u * u * b[3];
}
Eigen::Quaterniond on_curve(const std::array<Eigen::Quaterniond, 4>& b, double u) {
  const Eigen::Quaterniond c0 = b[0].slerp(u, b[1]), c1 = b[1].slerp(u, b[2]), c2 = b[2].slerp(u, b[3]);
  return c0.slerp(u, c1).slerp(u, c1.slerp(u, c2));
}

}  // namespace

void posture_of(const Bvh& bvh, double t_s, BvhPosture& into) {
  const double at = std::clamp(t_s / bvh.frame_time_s, 0.0, static_cast<double>(bvh.frames - 1));
  const std::size_t first = std::min(static_cast<std::size_t>(at), bvh.frames - 1 - (bvh.frames > 1 ? 1 : 0));
  const double share = at - static_cast<double>(first);
  const std::size_t second = std::min(first + 1, bvh.frames - 1);
  const bool has_before = first > 0, has_after = second + 1 < bvh.frames && second > first;
  const auto frame = [&](std::size_t i) { return bvh.values.data() + i * bvh.values_a_frame; };
  const std::array<const double*, 4> around{frame(has_before ? first - 1 : first), frame(first), frame(second),
                                            frame(has_after ? second + 1 : second)};
  const auto root = [&](std::size_t i) { return place_of(bvh.joints[0], around[i]); };
  const Eigen::Vector3d displacement = root(2) - root(1), before = root(1) - root(0), after = root(3) - root(2);
  const Eigen::Vector3d out = tangent(has_before ? &before : nullptr, &displacement);
  const Eigen::Vector3d in = tangent(&displacement, has_after ? &after : nullptr);
  into.root = on_curve({root(1), root(1) + out / 3.0, root(2) - in / 3.0, root(2)}, share);
  into.rotations.resize(bvh.joints.size());
  for (std::size_t i = 0; i < bvh.joints.size(); ++i) {
    const auto rotation_at = [&](std::size_t k) {
      return rotation_of(bvh.joints[i], around[k] + bvh.joints[i].first_value);
    };
    const Eigen::Quaterniond q1 = rotation_at(1), q2 = rotation_at(2);
    const Eigen::Vector3d step = rotation_vector(q1.conjugate() * q2);
    const Eigen::Vector3d before_step = rotation_vector(rotation_at(0).conjugate() * q1);
    const Eigen::Vector3d after_step = rotation_vector(q2.conjugate() * rotation_at(3));
    const Eigen::Vector3d leaving = tangent(has_before ? &before_step : nullptr, &step);
    const Eigen::Vector3d coming = tangent(&step, has_after ? &after_step : nullptr);
    into.rotations[i] =
        on_curve({q1, q1 * from_rotation_vector(leaving / 3.0), q2 * from_rotation_vector(-coming / 3.0), q2}, share);
  }
}

}  // namespace mocap::scene
