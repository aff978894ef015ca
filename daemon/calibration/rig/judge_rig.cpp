#include "calibration/rig/judge_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

// The grades' limits: up to the first a figure is excellent, up to the second good, up to the third fair.
struct Limits {
  double excellent;
  double good;
  double fair;
};
constexpr Limits kRms_px{0.25, 0.5, 1.0};          // 0.1 is what a good detector gives; over 1 matching suffers
constexpr Limits kHeldOutRatio{1.15, 1.3, 2.0};    // well determined rigs foretell as they fit
constexpr Limits kWandSpread{0.002, 0.005, 0.01};  // share of the wand's length
constexpr Limits kScale{0.0005, 0.001, 0.005};     // share: 1 mm in 2 m, in 1 m, in 20 cm
constexpr Limits kSigma_m{0.0005, 0.001, 0.005};   // median over the volume
constexpr Limits kFloor_m{0.002, 0.005, 0.015};    // of the markers that lie on it
constexpr Limits kPattern{0.3, 0.6, 1.5};          // of the camera's rms
constexpr double kPatternMatters_px = 0.03;        // under this a pattern harms nobody
constexpr double kGoodCoverage = 0.3;              // of the fields; with less the rest is guessed
constexpr double kFairCoverage = 0.12;
constexpr std::size_t kManyPoints = 150;
constexpr std::size_t kFewPoints = 40;
constexpr std::size_t kLeastHeldOut = 10;
constexpr int kLeastInField = 3;
constexpr double kMuchUnseen = 0.1;

Grade grade_of(double figure, const Limits& limits) {
  if (figure <= limits.excellent) return Grade::Excellent;
  if (figure <= limits.good) return Grade::Good;
  return figure <= limits.fair ? Grade::Fair : Grade::Poor;
}

struct Sum {
  double squares = 0.0;
  std::size_t points = 0;
  double rms() const { return points > 0 ? std::sqrt(squares / (2.0 * static_cast<double>(points))) : 0.0; }
};

// The index of a field; rows and columns are under kImageFields.
std::size_t at_field(int row, int column) {
  return static_cast<std::size_t>(row) * kImageFields + static_cast<std::size_t>(column);
}

int field_at(double at, int size) {
  return std::clamp(static_cast<int>(at * kImageFields / size), 0, kImageFields - 1);
}

// The mean square of the fields' means, of which chance gives variance over count.
double pattern_of(const CameraJudgement& camera) {
  double sum = 0.0;
  int fields = 0;
  for (const ImageField& field : camera.fields) {
    if (field.points < kLeastInField) continue;
    sum += 0.5 * field.residual_px.squaredNorm() - camera.rms_px * camera.rms_px / field.points;
    ++fields;
  }
  return fields > 0 ? std::sqrt(std::max(0.0, sum / fields)) : 0.0;
}

/// Gathers what keeps a rig from a better grade.
class Judge {
 public:
  explicit Judge(const RigEvidence& evidence) : evidence_(evidence) {}

  RigJudgement judge() {
    count_sights();
    judge_cameras();
    judge_all_cameras();
    judge_wand();
    judge_floor();
    judge_volume();
    auto& issues = judgement_.issues;
    std::stable_sort(issues.begin(), issues.end(), [](const auto& a, const auto& b) { return a.grade > b.grade; });
    if (!issues.empty()) judgement_.grade = issues.front().grade;
    return std::move(judgement_);
  }

 private:
  void issue(Grade grade, const std::string& text) {
    if (grade == Grade::Excellent) return;
    RigIssue& issue = judgement_.issues.emplace_back();
    issue.grade = grade;
    issue.text = text;
  }

  void count_sights() {
    const std::size_t n = evidence_.rig.size();
    std::vector<Sum> train(n);
    std::vector<Sum> held(n);
    judgement_.cameras.resize(n);
    for (const SightResidual& sight : evidence_.residuals) {
      const auto c = static_cast<std::size_t>(sight.camera);
      Sum& sum = sight.held_out ? held[c] : train[c];
      sum.squares += sight.residual_px.squaredNorm();
      ++sum.points;
      if (sight.held_out) continue;
      const CameraModel& model = evidence_.rig[c];
      const int row = field_at(sight.at.v.y() + 0.5, model.height_px);
      const int column = field_at(sight.at.v.x() + 0.5, model.width_px);
      ImageField& field = judgement_.cameras[c].fields[at_field(row, column)];
      ++field.points;
      field.residual_px += (sight.residual_px - field.residual_px) / field.points;
    }
    Sum all;
    Sum all_held;
    for (std::size_t c = 0; c < n; ++c) {
      CameraJudgement& camera = judgement_.cameras[c];
      camera.name = evidence_.rig[c].name;
      camera.rms_px = train[c].rms();
      camera.points = train[c].points;
      camera.heldout_points = held[c].points;
      if (held[c].points >= kLeastHeldOut) camera.heldout_px = held[c].rms();
      const auto covered = std::ranges::count_if(camera.fields, [](const ImageField& f) { return f.points > 0; });
      camera.coverage = static_cast<double>(covered) / static_cast<double>(camera.fields.size());
      camera.pattern_px = pattern_of(camera);
      all.squares += train[c].squares;
      all.points += train[c].points;
      all_held.squares += held[c].squares;
      all_held.points += held[c].points;
      const auto first = 6 * static_cast<Eigen::Index>(c);
      if (evidence_.covariance.rows() < first + 6) continue;
      camera.position_doubt_m = std::sqrt(evidence_.covariance.diagonal().segment<3>(first).sum());
      camera.rotation_doubt_rad = std::sqrt(evidence_.covariance.diagonal().segment<3>(first + 3).sum());
    }
    judgement_.rms_px = all.rms();
    if (all_held.points >= kLeastHeldOut) judgement_.heldout_px = all_held.rms();
  }

  void judge_cameras() {
    for (const CameraJudgement& camera : judgement_.cameras) {
      if (evidence_.residuals.empty()) return;
      const auto say = [&](Grade grade, const std::string& text) {
        issue(grade, fmt::format("camera '{}': {}", camera.name, text));
      };
      if (camera.points < kManyPoints) {
        say(camera.points < kFewPoints ? Grade::Poor : Grade::Fair,
            fmt::format("only {} points, expected {} at least; wave the wand longer where it looks", camera.points,
                        kManyPoints));
      } else if (camera.coverage < kGoodCoverage) {
        say(camera.coverage < kFairCoverage ? Grade::Fair : Grade::Good,
            fmt::format("points in {:.0f} % of its image only{}; wave there, too", 100.0 * camera.coverage,
                        empty_side(camera)));
      }
      say(grade_of(camera.rms_px, kRms_px),
          fmt::format("{:.2f} px rms, expected {:.2g} at most; look at its focus, exposure and false blobs, or "
                      "calibrate its lens anew (mocap-calibrate lens)",
                      camera.rms_px, kRms_px.good));
      if (camera.heldout_px && camera.rms_px > 0.0) {
        const double ratio = *camera.heldout_px / camera.rms_px;
        if (ratio > kHeldOutRatio.good) {
          say(grade_of(ratio, kHeldOutRatio),
              fmt::format("{:.2f} px rms on samples that it was not made of, {:.1f} times of those that it was; wave "
                          "longer before it, and nearer to its image's rim",
                          *camera.heldout_px, ratio));
        }
      }
      if (camera.pattern_px > kPatternMatters_px) {
        say(grade_of(camera.pattern_px / std::max(1e-9, camera.rms_px), kPattern),
            fmt::format("residuals have a pattern of {:.2f} px over its image: the lens file does not fit; calibrate "
                        "the lens (mocap-calibrate lens), or let the wand solve for it",
                        camera.pattern_px));
      }
    }
  }

  // Which side of the image has no points.
  static std::string empty_side(const CameraJudgement& camera) {
    constexpr int kQuarter = kImageFields / 4;
    std::array<int, 4> counts{};  // left, right, top, bottom
    for (int row = 0; row < kImageFields; ++row) {
      for (int column = 0; column < kImageFields; ++column) {
        const int points = camera.fields[at_field(row, column)].points;
        counts[0] += column < kQuarter ? points : 0;
        counts[1] += column >= kImageFields - kQuarter ? points : 0;
        counts[2] += row < kQuarter ? points : 0;
        counts[3] += row >= kImageFields - kQuarter ? points : 0;
      }
    }
    std::string sides;
    constexpr std::array<const char*, 4> kNames{"left", "right", "top", "bottom"};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      if (counts[i] == 0) sides += (sides.empty() ? ", none " : " and ") + std::string(kNames[i]);
    }
    return sides;
  }

  void judge_all_cameras() {
    // A mirrored rig explains its points as well as the right one; only that all stand before all cameras tells.
    if (evidence_.rig.size() < 2) issue(Grade::Poor, "fewer than two cameras: nothing can be located");
    if (!evidence_.residuals.empty() && evidence_.covariance.size() == 0) {
      issue(Grade::Fair, "how wrong the cameras may stand is not known: the samples do not determine the rig");
    }
  }

  void judge_wand() {
    if (evidence_.lengths_m.empty() || !(evidence_.told_length_m > 0.0)) return;
    WandJudgement wand;
    wand.told_m = evidence_.told_length_m;
    wand.samples = evidence_.lengths_m.size();
    for (const double length : evidence_.lengths_m) wand.mean_m += length / static_cast<double>(wand.samples);
    double squares = 0.0;
    for (const double length : evidence_.lengths_m) squares += (length - wand.mean_m) * (length - wand.mean_m);
    wand.std_m = std::sqrt(squares / static_cast<double>(wand.samples));
    const auto [least, most] = std::ranges::minmax_element(evidence_.lengths_m);
    wand.min_m = *least;
    wand.max_m = *most;
    judgement_.wand = wand;
    judgement_.scale_error = wand.mean_m / wand.told_m - 1.0;
    issue(
        grade_of(wand.std_m / wand.told_m, kWandSpread),
        fmt::format("the wand measures {:.2f} mm +- {:.2f}, expected {:.1f} +- {:.1f} at most; are its markers round, "
                    "and are the cameras synchronous?",
                    1e3 * wand.mean_m, 1e3 * wand.std_m, 1e3 * wand.told_m, 1e3 * kWandSpread.good * wand.told_m));
    issue(grade_of(std::abs(*judgement_.scale_error), kScale),
          fmt::format("scale is {:+.2f} % off by the wand's length; measure the wand, and tell its true length",
                      100.0 * *judgement_.scale_error));
  }

  void judge_floor() {
    if (!evidence_.floor_rms_m) {
      if (!evidence_.residuals.empty())
        issue(Grade::Good, "there is no floor yet: lay an L-frame or markers on it and run mocap-calibrate floor");
      return;
    }
    FloorJudgement floor;
    floor.rms_m = *evidence_.floor_rms_m;
    floor.lowest_camera_m = std::numeric_limits<double>::infinity();
    for (const CameraModel& camera : evidence_.rig) {
      floor.lowest_camera_m = std::min(floor.lowest_camera_m, camera.centre().v.z());
    }
    judgement_.floor = floor;
    if (floor.lowest_camera_m < 0.0) {
      issue(Grade::Poor, fmt::format("a camera stands {:.0f} mm under the floor: the world is upside down or mirrored; "
                                     "lay the floor anew (mocap-calibrate floor)",
                                     -1e3 * floor.lowest_camera_m));
    }
    issue(grade_of(floor.rms_m, kFloor_m),
          fmt::format("what lies on the floor is {:.1f} mm off it, expected {:.0f} at most; is it flat, and is the "
                      "frame's size right?",
                      1e3 * floor.rms_m, 1e3 * kFloor_m.good));
  }

  void judge_volume() {
    judgement_.volume = uncertainty_over(evidence_.points_m, evidence_.rig, evidence_.covariance, judgement_.rms_px);
    if (!judgement_.volume) return;
    const VolumeUncertainty& volume = *judgement_.volume;
    issue(
        grade_of(volume.median_m, kSigma_m),
        fmt::format("markers are known to {:.1f} mm in the middle of the volume's cells, expected {:.0f} at most; wave "
                    "longer, or set cameras nearer and at wider angles",
                    1e3 * volume.median_m, 1e3 * kSigma_m.good));
    if (volume.unseen_share > kMuchUnseen) {
      issue(Grade::Good, fmt::format("{:.0f} % of the box about the samples is seen by fewer than two cameras",
                                     100.0 * volume.unseen_share));
    }
  }

  const RigEvidence& evidence_;
  RigJudgement judgement_;
};

}  // namespace

const char* name_of(Grade grade) {
  switch (grade) {
    case Grade::Excellent: return "excellent";
    case Grade::Good: return "good";
    case Grade::Fair: return "fair";
    case Grade::Poor: return "poor";
  }
  return "";
}

RigJudgement judge_rig(const RigEvidence& evidence) { return Judge(evidence).judge(); }

}  // namespace mocap::calibration
