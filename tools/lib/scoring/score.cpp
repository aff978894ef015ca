#include "lib/scoring/score.h"

#include <algorithm>
#include <cmath>

namespace mocap::scoring {
namespace {

constexpr double kMm = 1000.0;
constexpr double kDegrees = 180.0 / 3.141592653589793;

// Root mean square and maximum of the added values.
class Spread {
 public:
  void add(double value) {
    sum_of_squares_ += value * value;
    max_ = std::max(max_, value);
    ++count_;
  }
  std::optional<double> rms() const {
    if (count_ == 0) return std::nullopt;
    return std::sqrt(sum_of_squares_ / static_cast<double>(count_));
  }
  std::optional<double> max() const { return count_ == 0 ? std::nullopt : std::optional(max_); }

 private:
  double sum_of_squares_ = 0.0;
  double max_ = 0.0;
  std::uint64_t count_ = 0;
};

template <class Things, class Same>
const typename Things::value_type* find(const Things& things, Same same) {
  const auto found = std::find_if(things.begin(), things.end(), same);
  return found == things.end() ? nullptr : &*found;
}

class Judge {
 public:
  explicit Judge(const ScoreSettings& settings) : settings_(settings) {}

  void judge(const EvalFrame& truth, const EvalFrame& reported) {
    ++score_.frames;
    if (reported.expected_views > 0 && reported.views >= reported.expected_views) ++complete_;
    judge_labels(truth, reported);
    judge_bones(truth, reported);
    judge_unlabelled(truth, reported);
  }

  Score take() {
    if (score_.frames > 0) {
      score_.complete_share = static_cast<double>(complete_) / static_cast<double>(score_.frames);
    }
    score_.missing = score_.labels_expected - given_;
    score_.marker_rms_mm = measured_mm_.rms();
    score_.marker_max_mm = measured_mm_.max();
    score_.filled_rms_mm = filled_mm_.rms();
    score_.joint_rms_mm = joints_mm_.rms();
    score_.joint_max_mm = joints_mm_.max();
    score_.rotation_rms_deg = rotations_deg_.rms();
    return score_;
  }

 private:
  void judge_labels(const EvalFrame& truth, const EvalFrame& reported) {
    score_.labels_expected += truth.markers.size();
    for (const NamedMarker& marker : reported.markers) {
      const NamedMarker* own =
          find(truth.markers, [&](const auto& m) { return m.subject == marker.subject && m.marker == marker.marker; });
      if (own == nullptr) {
        ++score_.unknown_labels;
        continue;
      }
      ++given_;
      const double off_mm = kMm * (marker.position_m - own->position_m).norm();
      const bool measured = marker.state == LabelState::Measured;
      if (!measured) filled_mm_.add(off_mm);
      if (measured ? is_wrong(truth, marker, *own, off_mm) : off_mm > settings_.wrong_from_mm) {
        ++(measured ? score_.label_errors : score_.filled_off);
        continue;
      }
      ++score_.labels_right;
      if (measured) measured_mm_.add(off_mm);
    }
  }

  bool is_wrong(const EvalFrame& truth, const NamedMarker& marker, const NamedMarker& own, double off_mm) const {
    if (off_mm > settings_.wrong_from_mm) return true;
    return find(truth.markers, [&](const auto& m) {
             return &m != &own && kMm * (marker.position_m - m.position_m).norm() < off_mm;
           }) != nullptr;
  }

  void judge_bones(const EvalFrame& truth, const EvalFrame& reported) {
    for (const PosedBone& bone : reported.bones) {
      const PosedBone* own =
          find(truth.bones, [&](const auto& b) { return b.subject == bone.subject && b.bone == bone.bone; });
      if (own == nullptr) continue;
      joints_mm_.add(kMm * (bone.position_m - own->position_m).norm());
      rotations_deg_.add(kDegrees * bone.rotation.angularDistance(own->rotation));
    }
  }

  void judge_unlabelled(const EvalFrame& truth, const EvalFrame& reported) {
    score_.unlabelled += reported.unlabelled_m.size();
    for (const Eigen::Vector3d& found : reported.unlabelled_m) {
      const auto near = [&](const NamedMarker& m) {
        return kMm * (found - m.position_m).norm() <= settings_.ghost_from_mm;
      };
      if (find(truth.markers, near) == nullptr) ++score_.ghosts;
    }
  }

  ScoreSettings settings_;
  Score score_;
  std::uint64_t complete_ = 0;
  std::uint64_t given_ = 0;  // reported labels that the truth contains
  Spread measured_mm_;
  Spread filled_mm_;
  Spread joints_mm_;
  Spread rotations_deg_;
};

void count_numbers(const std::vector<EvalFrame>& stream, Score& score) {
  for (std::size_t i = 1; i < stream.size(); ++i) {
    const std::uint64_t before = stream[i - 1].number;
    const std::uint64_t now = stream[i].number;
    if (now <= before) {
      ++score.duplicates;
    } else {
      score.gaps += now - before - 1;
    }
  }
}

}  // namespace

Score score(const Truth& truth, const std::vector<EvalFrame>& stream, const ScoreSettings& settings) {
  const auto first = std::find_if(stream.begin(), stream.end(), [](const auto& f) { return !f.markers.empty(); });
  Judge judge(settings);
  std::uint64_t without_truth = 0;
  for (auto frame = first; frame != stream.end(); ++frame) {
    if (frame->exposed_at < first->exposed_at + from_s(settings.after_s)) continue;
    if (const std::optional<EvalFrame> known = truth.at(frame->exposed_at)) {
      judge.judge(*known, *frame);
    } else {
      ++without_truth;
    }
  }
  Score result = judge.take();
  result.stream_frames = stream.size();
  result.frames_without_truth = without_truth;
  if (first != stream.end()) result.time_to_first_label_s = to_s(first->exposed_at - stream.front().exposed_at);
  count_numbers(stream, result);
  return result;
}

}  // namespace mocap::scoring
