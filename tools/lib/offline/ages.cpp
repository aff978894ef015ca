#include "lib/offline/ages.h"

#include <cmath>
#include <cstring>
#include <limits>

namespace mocap::offline {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();

float age_of(std::map<std::pair<std::uint32_t, std::size_t>, Timestamp>& last, std::uint32_t subject, std::size_t index,
             bool is_measured, Timestamp now) {
  if (is_measured) {
    last[{subject, index}] = now;
    return 0.0F;
  }
  const auto known = last.find({subject, index});
  return known == last.end() ? kNever : static_cast<float>(to_s(now - known->second));
}

}  // namespace

Ages AgeWatch::next(const Snapshot& snapshot) {
  const Timestamp now = snapshot.instants.exposed_at;
  Ages ages;
  for (const SubjectLabels& subject : snapshot.labels) {
    const std::uint32_t id = subject.subject.value;
    if (subject.phase != SubjectPhase::Tracking) {
      const auto is_its = [&](const auto& entry) { return entry.first.first == id; };
      std::erase_if(labels_, is_its);
      std::erase_if(bones_, is_its);
    }
    std::vector<float>& each = ages.labels.emplace_back();
    for (std::size_t m = 0; m < subject.markers.size(); ++m) {
      each.push_back(age_of(labels_, id, m, subject.markers[m].state == LabelState::Measured, now));
    }
  }
  for (const SubjectPose& pose : snapshot.poses) {
    std::vector<float>& each = ages.bones.emplace_back();
    for (std::size_t b = 0; b < pose.bones.size(); ++b) {
      each.push_back(age_of(bones_, pose.subject.value, b, pose.bones[b].state == BoneState::Measured, now));
    }
  }
  return ages;
}

double forward_share(float forward_age_s, float backward_age_s) {
  if (std::isinf(backward_age_s)) return 1.0;
  if (std::isinf(forward_age_s)) return 0.0;
  const double sum_s = static_cast<double>(forward_age_s) + static_cast<double>(backward_age_s);
  return sum_s > 0.0 ? static_cast<double>(backward_age_s) / sum_s : 1.0;
}

std::string encode(const Ages& ages) {
  std::string bytes;
  for (const auto* columns : {&ages.labels, &ages.bones}) {
    for (const std::vector<float>& each : *columns) {
      bytes.append(reinterpret_cast<const char*>(each.data()), each.size() * sizeof(float));  // NOLINT: bytes
    }
  }
  return bytes;
}

std::optional<Ages> decode_ages(std::string_view bytes, const Snapshot& snapshot) {
  Ages ages;
  const auto take = [&](std::vector<std::vector<float>>& columns, std::size_t count) {
    std::vector<float>& each = columns.emplace_back(count);
    if (bytes.size() < count * sizeof(float)) return false;
    if (count > 0) std::memcpy(each.data(), bytes.data(), count * sizeof(float));
    bytes.remove_prefix(count * sizeof(float));
    return true;
  };
  for (const SubjectLabels& subject : snapshot.labels) {
    if (!take(ages.labels, subject.markers.size())) return std::nullopt;
  }
  for (const SubjectPose& pose : snapshot.poses) {
    if (!take(ages.bones, pose.bones.size())) return std::nullopt;
  }
  return bytes.empty() ? std::optional(ages) : std::nullopt;
}

}  // namespace mocap::offline
