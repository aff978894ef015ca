#include "calibration/diagnosis/diagnose_rig.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calibration/diagnosis/camera_views.h"
#include "calibration/diagnosis/consensus_points.h"
#include "calibration/diagnosis/fit_camera.h"
#include "calibration/diagnosis/reprojection_evidence.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Instants evaluated. The statistic of a wrong camera grows with their square root: about 20 with 60, 10 with 16.
constexpr std::size_t kMostInstants = 60;
constexpr std::size_t kFewestInstants = 16;
// Pairs of rays of two cameras that are compared for one hypothesis; bounds the work with many people. Eight cameras
// with 41 markers need 2.8e6 for all instants.
constexpr double kMostRayPairs = 4e6;
// Exchanges that are evaluated completely: the most likely ones by the points of the rig as it is. A rig of eight
// cameras on a ring has four equal ones.
constexpr std::size_t kMostExchanges = 8;
// Only cameras that see less are candidates for an exchange and for a fit. Bounds the work, does not decide.
constexpr double kWellExplained = 0.5;
// With more cameras that do not fit, no exchange of two explains the rig. Bounds the work to 66 exchanges.
constexpr std::size_t kMaxExchangeable = 12;
// A camera that fits no hypothesis is undetermined if it has fewer expected views. With kMinExpected, a camera that
// sees one marker in ten has 20 views: its statistic exceeds kSignificant almost surely.
constexpr double kMinExpected = 200.0;

/// A rig under a hypothesis, with the points and the evidence that follow.
class EvaluatedRig {
 public:
  using Points = std::vector<std::vector<ConsensusPoint>>;

  EvaluatedRig(const Instants& instants, Rig rig, std::vector<ImageSource> sources, Fallback fallback)
      : instants_(&instants), rig_(std::move(rig)), sources_(std::move(sources)) {
    for (std::size_t c = 0; c < rig_.size(); ++c) views_.push_back(views_of(instants, rig_[c], sources_[c]));
    const RayIntersections intersections = find_intersections(views_);
    for (std::size_t c = 0; c < rig_.size(); ++c) {
      points_.push_back(consensus_points(intersections, views_, c, fallback));
      evidence_.push_back(evidence_of(views_[c], points_[c]));
    }
  }

  const Instants& instants() const { return *instants_; }
  const Rig& rig() const { return rig_; }
  const std::vector<ImageSource>& sources() const { return sources_; }
  const CameraViews& views(std::size_t camera) const { return views_[camera]; }
  /// The points that the other cameras agree on.
  const Points& points(std::size_t camera) const { return points_[camera]; }
  const ReprojectionEvidence& evidence(std::size_t camera) const { return evidence_[camera]; }

  /// The log likelihood ratios of all cameras, by instant.
  std::vector<double> log_ratio() const {
    std::vector<double> sum(evidence_.front().log_ratio.size(), 0.0);
    for (const ReprojectionEvidence& evidence : evidence_) {
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += evidence.log_ratio[i];
    }
    return sum;
  }
  bool fits(std::size_t camera) const {
    const auto& log_ratio = evidence_[camera].log_ratio;
    return vuong_statistic(log_ratio, std::vector<double>(log_ratio.size(), 0.0), 1.0, evidence_[camera].samples) >
           kSignificant;
  }

 private:
  const Instants* instants_;
  Rig rig_;
  std::vector<ImageSource> sources_;
  std::vector<CameraViews> views_;
  std::vector<Points> points_;
  std::vector<ReprojectionEvidence> evidence_;
};

/// A finding, and the rig that it leads to.
struct Hypothesis {
  RigFinding finding;
  Rig rig;
  std::vector<ImageSource> sources;
  std::vector<double> log_ratio;  ///< of the cameras that it changes, or of all (Exchanged), by instant
  double gain = 0.0;              ///< of the total log likelihood
  bool is_small = false;          ///< the drift watch measures it: is applied, but no fault
};

// Completes a hypothesis that changes one camera.
Hypothesis of_one_camera(const EvaluatedRig& evaluated, std::size_t camera, RigFault fault, const CameraModel& model,
                         const ImageSource& source) {
  Hypothesis hypothesis{{.fault = fault, .camera = camera, .model = model}, evaluated.rig(), evaluated.sources(), {}};
  hypothesis.rig[camera] = model;
  hypothesis.sources[camera] = source;
  const ReprojectionEvidence after =
      evidence_of(views_of(evaluated.instants(), model, source), evaluated.points(camera));
  const ReprojectionEvidence& before = evaluated.evidence(camera);
  const double parameters = fault == RigFault::OtherPose   ? kPoseParameters
                            : fault == RigFault::OtherLens ? kLensParameters
                                                           : 0.0;
  RigFinding& finding = hypothesis.finding;
  finding.share_before = before.share();
  finding.share_after = after.share();
  finding.statistic = vuong_statistic(after.log_ratio, before.log_ratio, parameters, after.samples);
  hypothesis.gain =
      after.total() - before.total() - 0.5 * parameters * std::log(std::max(1.0, static_cast<double>(after.samples)));
  hypothesis.log_ratio = after.log_ratio;
  return hypothesis;
}

// Images that are flipped or of another instant.
std::vector<Hypothesis> image_hypotheses(const EvaluatedRig& evaluated, std::size_t camera) {
  struct Variant {
    RigFault fault;
    bool flip_x, flip_y;
    int shift;
  };
  constexpr Variant kVariants[] = {{RigFault::UpsideDown, true, true, 0},
                                   {RigFault::MirroredSides, true, false, 0},
                                   {RigFault::MirroredHeights, false, true, 0},
                                   {RigFault::OneFrameLate, false, false, 1},
                                   {RigFault::OneFrameEarly, false, false, -1}};
  std::vector<Hypothesis> hypotheses;
  for (const auto& [fault, flip_x, flip_y, shift] : kVariants) {
    ImageSource source = evaluated.sources()[camera];
    source.flip_x ^= flip_x;
    source.flip_y ^= flip_y;
    source.shift += shift;
    hypotheses.push_back(of_one_camera(evaluated, camera, fault, evaluated.rig()[camera], source));
  }
  return hypotheses;
}

// Root mean square distance of the projections of the points by two models of a camera; of those that both see.
double displacement_px(const CameraModel& a, const CameraModel& b, const EvaluatedRig::Points& points) {
  double sum = 0.0;
  double count = 0.0;
  double seen = 0.0;
  for (const auto& instant : points) {
    for (const ConsensusPoint& point : instant) {
      const auto at_a = geometry::project(a, point.point);
      const auto at_b = geometry::project(b, point.point);
      if (!at_b || !geometry::in_image(b, *at_b)) continue;
      seen += 1.0;
      if (!at_a) continue;
      sum += (at_a->v - at_b->v).squaredNorm();
      count += 1.0;
    }
  }
  return 2.0 * count < seen ? 1e9 : std::sqrt(sum / std::max(1.0, count));
}

// Another pose, another lens.
std::vector<Hypothesis> fitted_hypotheses(const EvaluatedRig& evaluated, std::size_t camera) {
  const CameraModel& before = evaluated.rig()[camera];
  const CameraViews& views = evaluated.views(camera);
  const EvaluatedRig::Points& points = evaluated.points(camera);
  std::vector<Hypothesis> hypotheses;
  for (const RigFault fault : {RigFault::OtherPose, RigFault::OtherLens}) {
    const auto model = fault == RigFault::OtherPose ? fit_pose(views, points) : fit_focal_length(views, points);
    if (!model) continue;
    Hypothesis hypothesis = of_one_camera(evaluated, camera, fault, *model, evaluated.sources()[camera]);
    hypothesis.is_small = displacement_px(before, *model, points) < kReprojectionGate_px;
    RigFinding& finding = hypothesis.finding;
    const Eigen::Matrix3d turn = model->camera_from_world.rotation * before.camera_from_world.rotation.transpose();
    finding.turned_rad = std::abs(Eigen::AngleAxisd(turn).angle());
    finding.moved_m = (model->centre().v - before.centre().v).norm();
    finding.focal_ratio = model->lens.fx_px / before.lens.fx_px;
    hypotheses.push_back(std::move(hypothesis));
  }
  return hypotheses;
}

Hypothesis of_exchange(const EvaluatedRig& evaluated, std::size_t a, std::size_t b) {
  Hypothesis hypothesis{
      {.fault = RigFault::Exchanged, .camera = a, .other = b}, evaluated.rig(), evaluated.sources(), {}};
  std::swap(hypothesis.sources[a], hypothesis.sources[b]);
  // An exchange that leaves hardly any three cameras in agreement explains nothing.
  const EvaluatedRig after(evaluated.instants(), hypothesis.rig, hypothesis.sources, Fallback::None);
  hypothesis.log_ratio = after.log_ratio();
  const std::vector<double> before = evaluated.log_ratio();
  for (std::size_t i = 0; i < before.size(); ++i) hypothesis.gain += hypothesis.log_ratio[i] - before[i];
  RigFinding& finding = hypothesis.finding;
  finding.statistic = vuong_statistic(hypothesis.log_ratio, before, 0.0, 0);
  finding.share_before = std::min(evaluated.evidence(a).share(), evaluated.evidence(b).share());
  finding.share_after = std::min(after.evidence(a).share(), after.evidence(b).share());
  return hypothesis;
}

bool have_one_size(const CameraModel& a, const CameraModel& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px;
}

/// Two cameras that may have each other's images.
struct Exchange {
  std::size_t a = 0;
  std::size_t b = 0;
  double gain = 0.0;  ///< of the log likelihood of both cameras, with the points as they are
};

double gain_of_exchange(const EvaluatedRig& evaluated, std::size_t a, std::size_t b) {
  double gain = -evaluated.evidence(a).total() - evaluated.evidence(b).total();
  for (const auto& [camera, other] : {std::pair(a, b), std::pair(b, a)}) {
    const CameraViews views = views_of(evaluated.instants(), evaluated.rig()[camera], evaluated.sources()[other]);
    gain += evidence_of(views, evaluated.points(camera)).total();
  }
  return gain;
}

std::vector<Hypothesis> exchanges(const EvaluatedRig& evaluated) {
  std::vector<Exchange> likely;
  const Rig& rig = evaluated.rig();
  std::vector<std::size_t> candidates;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (evaluated.evidence(c).share() < kWellExplained) candidates.push_back(c);
  }
  if (candidates.size() > kMaxExchangeable) return {};
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    for (std::size_t b = a + 1; b < candidates.size(); ++b) {
      if (have_one_size(rig[candidates[a]], rig[candidates[b]]))
        likely.push_back({candidates[a], candidates[b], gain_of_exchange(evaluated, candidates[a], candidates[b])});
    }
  }
  std::ranges::stable_sort(likely, std::ranges::greater{}, &Exchange::gain);
  if (likely.size() > kMostExchanges) likely.resize(kMostExchanges);
  std::vector<Hypothesis> hypotheses;
  for (const Exchange& exchange : likely) hypotheses.push_back(of_exchange(evaluated, exchange.a, exchange.b));
  return hypotheses;
}

std::optional<Hypothesis> best_of(std::vector<Hypothesis> hypotheses) {
  std::erase_if(hypotheses, [](const Hypothesis& each) { return each.finding.statistic < kSignificant; });
  if (hypotheses.empty()) return std::nullopt;
  const auto best = std::ranges::max_element(hypotheses, {}, &Hypothesis::gain);
  Hypothesis chosen = std::move(*best);
  hypotheses.erase(best);
  if (chosen.finding.fault != RigFault::Exchanged) return chosen;
  for (const Hypothesis& each : hypotheses) {
    const bool as_good = each.finding.fault == RigFault::Exchanged &&
                         vuong_statistic(chosen.log_ratio, each.log_ratio, 0.0, 0) < kSignificant;
    if (as_good) chosen.finding.alternatives.emplace_back(each.finding.camera, each.finding.other);
  }
  return chosen;
}

std::optional<Hypothesis> best_explanation(const EvaluatedRig& evaluated, const DiagnosisProgress& progress) {
  if (progress) progress("exchanges of two cameras");
  std::vector<Hypothesis> all = exchanges(evaluated);
  const auto add = [&](std::vector<Hypothesis> more) {
    all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  for (std::size_t c = 0; c < evaluated.rig().size(); ++c) {
    if (progress) progress("camera " + evaluated.rig()[c].name);
    add(image_hypotheses(evaluated, c));
    if (evaluated.evidence(c).share() < kWellExplained) add(fitted_hypotheses(evaluated, c));
  }
  return best_of(std::move(all));
}

// The cameras that still do not fit.
void judge_rest(const EvaluatedRig& evaluated, RigDiagnosis& diagnosis) {
  std::vector<RigFinding> unexplained;
  for (std::size_t c = 0; c < evaluated.rig().size(); ++c) {
    if (evaluated.fits(c)) continue;
    if (evaluated.evidence(c).expected < kMinExpected) {
      diagnosis.undetermined.push_back(c);
    } else {
      unexplained.push_back(
          {.fault = RigFault::Unexplained, .camera = c, .share_before = evaluated.evidence(c).share()});
    }
  }
  if (2 * unexplained.size() > evaluated.rig().size()) unexplained = {{.fault = RigFault::OtherRig}};
  diagnosis.findings.insert(diagnosis.findings.end(), unexplained.begin(), unexplained.end());
}

// Pairs of rays of two cameras at one instant, in the mean.
double ray_pairs(const Instants& instants) {
  const auto& cameras = instants.recording.cameras;
  double pairs = 0.0;
  for (const Instant& instant : instants.selected) {
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const int image = instant.image[c];
      const auto blobs =
          image < 0 ? 0.0 : static_cast<double>(cameras[c][static_cast<std::size_t>(image)].spots.size());
      sum += blobs;
      squares += blobs * blobs;
    }
    pairs += 0.5 * (sum * sum - squares);
  }
  return pairs / std::max<double>(1.0, static_cast<double>(instants.selected.size()));
}

Instants instants_of(const Take& recording) {
  Instants instants = select_instants(recording, kMostInstants);
  const double affordable = kMostRayPairs / std::max(1.0, ray_pairs(instants));
  if (affordable >= static_cast<double>(kMostInstants)) return instants;
  return select_instants(recording, std::max(kFewestInstants, static_cast<std::size_t>(affordable)));
}

}  // namespace

RigDiagnosis diagnose_rig(const Rig& rig, const Take& recording, const DiagnosisProgress& progress) {
  RigDiagnosis diagnosis;
  std::vector<ImageSource> sources;
  for (std::size_t c = 0; c < rig.size(); ++c) sources.push_back({.camera = c});
  const Instants instants = instants_of(recording);
  if (rig.size() < kMinDiagnosedCameras || instants.selected.empty()) {
    diagnosis.share.assign(rig.size(), 0.0);
    for (std::size_t c = 0; c < rig.size(); ++c) diagnosis.undetermined.push_back(c);
    return diagnosis;
  }
  EvaluatedRig evaluated(instants, rig, sources, Fallback::Pairs);
  for (std::size_t c = 0; c < rig.size(); ++c) diagnosis.share.push_back(evaluated.evidence(c).share());
  for (std::size_t round = 0; round < rig.size(); ++round) {
    auto best = best_explanation(evaluated, progress);
    if (!best) break;
    if (!best->is_small) diagnosis.findings.push_back(std::move(best->finding));
    evaluated = EvaluatedRig(instants, std::move(best->rig), std::move(best->sources), Fallback::Pairs);
  }
  judge_rest(evaluated, diagnosis);
  return diagnosis;
}

}  // namespace mocap::calibration
