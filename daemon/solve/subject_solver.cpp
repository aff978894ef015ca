#include "solve/subject_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/expects.h"
#include "kinematics/rotation.h"

namespace mocap::solve {
namespace {

using pose::BodyFollower;

// A marker that the body tells is never surer than this, nor less sure than an arm's swing.
constexpr double kLeastSigma_m = 0.005;
constexpr double kMostSigma_m = 0.15;
// A ray is that of the marker where that was measured just before and its place is known well; else when the same
// camera has seen it, as far as a limb moves, in so many sets: what is no marker flashes in one.
constexpr double kSureAcross_m = 0.02;
constexpr int kFollowedSets = 2;
constexpr double kRaySigmas = 4.0;
// What the body's motion is wrong by: at least, and for each m that a marker moves from set to set. A hand that is
// thrown leaves what a set tells within the next.
constexpr double kSurprise_m = 0.005;
constexpr double kSurprisePerStep = 0.3;
constexpr double kFastest_m_s = 12.0;
constexpr double kRayGap_s = 0.1;
// How surely a surmised marker tells its limb.
constexpr double kSurmisedSigma_m = 0.01;
// A limb may take so long to be found again where its markers came back.
constexpr double kChangeLasts_s = 0.1;
// A body whose markers commonly are nearer to their places than the settings say is believed to be so well known, at
// least this well; over which time that is learnt.
constexpr double kLeastSkin_m = 0.0005;
constexpr double kOfResidual = 1.5;
constexpr double kLearnSkin_s = 0.5;
constexpr std::size_t kTellSkin = 6;  // fewer markers fit any body
// Over which velocities are taken; and a gap in the sets after which they mean nothing.
constexpr double kVelocity_s = 0.02;
constexpr double kLongGap_s = 0.25;
// What a confidence is about: a bone's joint, and a point of it so far from the joint, are within this of their places.
constexpr double kNear_m = 0.03;
constexpr double kLever_m = 0.1;
constexpr double kInJoint_m = 1e-3;
constexpr float kByRay = 0.8F;

// That a point of normal error, `sigma` on each of three axes, is within r. (The chi distribution of three degrees.)
double within(double r, double sigma) {
  const double x = r / std::max(sigma, 1e-9);
  if (x > 6.0) return 1.0;
  return std::erf(x / std::numbers::sqrt2) - std::sqrt(2.0 / std::numbers::pi) * x * std::exp(-0.5 * x * x);
}

}  // namespace

SubjectSolver::SubjectSolver(const SolveSettings& settings, const Subject& subject)
    : settings_(settings),
      body_(subject.marker_set, {.outlier_m = settings.outlier_m, .max_iterations = settings.max_iterations}),
      easer_(subject.marker_set.skeleton.bones.size()),
      smoother_(settings.smoothing, subject.marker_set.skeleton.bones.size()) {
  const auto& bones = subject.marker_set.skeleton.bones;
  const std::size_t markers = subject.marker_set.markers.size();
  MOCAP_EXPECTS(bones.size() <= kMaxBones && markers <= kMaxLabels);
  for (const Bone& bone : bones) parents_.push_back(bone.parent);
  bones_.resize(bones.size());
  rays_.resize(markers);
  covariances_m2_.resize(markers, Eigen::Matrix3d::Identity());
  how_seen_.resize(markers, Seen::No);
  ray_of_.resize(markers);
  own_markers_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) ++own_markers_[static_cast<std::size_t>(marker.bone)];
  turn_shows_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) {
    int bone = marker.offset_m.norm() > kInJoint_m ? marker.bone : parents_[static_cast<std::size_t>(marker.bone)];
    for (; bone >= 0; bone = parents_[static_cast<std::size_t>(bone)])
      turn_shows_[static_cast<std::size_t>(bone)] = true;
  }
  seen_markers_.resize(bones.size());
  changed_.resize(bones.size());
  changed_near_.resize(bones.size());
  world_.resize(bones.size());
  as_before_.resize(bones.size());
  seen_.reserve(markers);
}

// Of a body that is followed, what is shown goes from the old one's pose to the new one's in the same set.
void SubjectSolver::refit(const SubjectFit& fit) {
  if (body_.following()) {
    refit_ = fit;
  } else {
    body_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
  }
}

// The pose of the body as it is known now, after that of the one that it was taken for.
void SubjectSolver::wear_refit() {
  std::copy(body_.pose().locals().begin(), body_.pose().locals().end(), as_before_.begin());
  const SubjectFit& fit = *refit_;
  body_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
  refit_.reset();
  (void)body_.fit(seen_);
  refitted_ = true;
}

// A marker tells its bone, and the one above, whose far end it shows.
void SubjectSolver::note_seen(std::size_t marker, Seen how) {
  how_seen_[marker] = how;
  const auto bone = static_cast<std::size_t>(body_.pose().marker_set().markers[marker].bone);
  // Any odd multiplier that mixes well; of markers that differ the sums differ.
  const std::uint64_t sign = (2 * marker + (how == Seen::Ray ? 2 : 1)) * 0x9E37'79B9'7F4A'7C15U;
  bones_[bone].markers_now += sign;
  if (parents_[bone] >= 0) bones_[static_cast<std::size_t>(parents_[bone])].markers_now += sign;
}

void SubjectSolver::gather(const SubjectLabels& labels, Timestamp at) {
  seen_.clear();
  std::fill(seen_markers_.begin(), seen_markers_.end(), 0);
  std::fill(how_seen_.begin(), how_seen_.end(), Seen::No);
  std::fill(ray_of_.begin(), ray_of_.end(), nullptr);
  for (BoneMemory& bone : bones_) bone.markers_now = 0;
  const MarkerSet& set = body_.pose().marker_set();
  for (std::size_t m = 0; m < labels.markers.size() && m < how_seen_.size(); ++m) {
    const LabelledMarker& label = labels.markers[m];
    if (label.state != LabelState::Measured || !label.position.v.allFinite()) continue;
    seen_.push_back(kinematics::observe_point(static_cast<int>(m), label.position.v, label.covariance_m2, skin_sigma_m_));
    note_seen(m, Seen::Measured);
    const auto bone = static_cast<std::size_t>(set.markers[m].bone);
    ++seen_markers_[bone];
    bones_[bone].seen_at = at;
  }
}

// Whether a ray tells the marker's bone, or the one above or below.
bool SubjectSolver::told_by_ray(std::size_t marker) const {
  const auto& markers = body_.pose().marker_set().markers;
  const int bone = markers[marker].bone;
  for (std::size_t m = 0; m < ray_of_.size(); ++m) {
    if (ray_of_[m] == nullptr) continue;
    const int other = markers[m].bone;
    if (other == bone || parents_[static_cast<std::size_t>(other)] == bone ||
        parents_[static_cast<std::size_t>(bone)] == other)
      return true;
  }
  return false;
}

// A limb goes where a marker of its own is, whichever that is. A ray has a name, and tells more.
void SubjectSolver::gather_surmised(SubjectId id, std::span<const SurmisedMarker> surmised) {
  for (const SurmisedMarker& one : surmised) {
    const std::size_t m = one.label.marker;
    if (one.label.subject != id || m >= how_seen_.size() || how_seen_[m] != Seen::No || told_by_ray(m)) continue;
    kinematics::Observation& seen = seen_.emplace_back();
    seen.marker = static_cast<int>(m);
    seen.position = one.position.v;
    seen.sigma_m = std::hypot(kSurmisedSigma_m, one.sigma_m);
    seen.surmised = true;
  }
}

// How far markers stray from this body commonly: a prior must not bend what markers agree on to a tenth of that.
void SubjectSolver::learn_skin(Timestamp at) {
  if (seen_.size() < kTellSkin) return;
  const double share = 1.0 - std::exp(-std::max(0.0, to_s(at - skin_at_)) / kLearnSkin_s);
  // A larger residual is believed at once.
  const double residual_m = body_.residual_m();
  usual_residual_m_ += (residual_m > usual_residual_m_ ? 1.0 : share) * (residual_m - usual_residual_m_);
  skin_at_ = at;
  skin_sigma_m_ = std::min(settings_.marker_sigma_m, std::max(kLeastSkin_m, kOfResidual * usual_residual_m_));
}

// The rays of markers that are not measured, from where the motion led to.
void SubjectSolver::gather_rays(SubjectId id, std::span<const NamedRay> rays, Timestamp at) {
  for (const NamedRay& ray : rays) {
    const std::size_t m = ray.label.marker;
    if (ray.label.subject != id || m >= how_seen_.size() || how_seen_[m] != Seen::No) continue;
    if (!believed(m, ray, at)) continue;
    seen_.push_back(kinematics::observe_ray(static_cast<int>(m), ray.eye.v, ray.direction, ray.sigma_rad,
                                      body_.pose().marker_at(m), skin_sigma_m_));
    note_seen(m, Seen::Ray);
    ray_of_[m] = &ray;
  }
}

bool SubjectSolver::believed(std::size_t marker, const NamedRay& ray, Timestamp at) {
  if (!ray.eye.v.allFinite() || !ray.direction.allFinite() || !(ray.sigma_rad >= 0.0)) return false;
  const Eigen::Vector3d from_eye = body_.told(marker) - ray.eye.v;
  const double depth_m = from_eye.dot(ray.direction);
  if (!(depth_m > 0.0)) return false;
  const double gap_s = to_s(at - rays_[marker].at);
  RayMemory& memory = rays_[marker];
  const double moved_m = depth_m * (ray.direction - memory.direction).norm();
  const bool goes_on = memory.sets > 0 && memory.camera == ray.camera && gap_s > 0.0 && gap_s < kRayGap_s &&
                       moved_m < kFastest_m_s * gap_s;
  memory = {ray.camera, ray.direction, at, goes_on ? memory.sets + 1 : 1};

  const Eigen::Matrix3d& told = covariances_m2_[marker];
  const double across_m2 = std::max(0.0, 0.5 * (told.trace() - ray.direction.dot(told * ray.direction)));
  const double off_m = (from_eye - depth_m * ray.direction).norm();
  const double step_m = body_.speed_of(marker) * to_s(at - body_.learnt_at());
  const double surprise_m = kSurprise_m + kSurprisePerStep * step_m;
  const double off_m2 = across_m2 + surprise_m * surprise_m + std::pow(ray.sigma_rad * depth_m, 2);
  if (off_m > kRaySigmas * std::sqrt(off_m2)) return false;
  const bool just_measured = body_.unseen_s(marker, body_.learnt_at()) == 0.0;
  return (just_measured && across_m2 < kSureAcross_m * kSureAcross_m) || memory.sets >= kFollowedSets;
}

// Which bones other markers tell now, or their neighbours up to the second.
void SubjectSolver::find_changes(Timestamp at) {
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& bone = bones_[b];
    const bool changed = bone.markers != bone.markers_now;
    if (fresh_) bone.changed_at = at - 2 * from_s(kChangeLasts_s);
    if (changed && !fresh_) bone.changed_at = at;
    bone.markers = bone.markers_now;
    changed_[b] = to_s(at - bone.changed_at) <= kChangeLasts_s ? 1 : 0;
  }
  for (int reach = 0; reach < 2; ++reach) {
    std::copy(changed_.begin(), changed_.end(), changed_near_.begin());
    for (std::size_t b = 1; b < bones_.size(); ++b) {
      if (parents_[b] < 0) continue;
      const auto parent = static_cast<std::size_t>(parents_[b]);
      changed_near_[b] |= changed_[parent];
      changed_near_[parent] |= changed_[b];
    }
    changed_.swap(changed_near_);
  }
}

// Half of a bone's own markers tell it; a bone without any is told by its neighbours.
bool SubjectSolver::bone_seen(std::size_t bone) const {
  if (own_markers_[bone] > 0) return 2 * seen_markers_[bone] >= own_markers_[bone];
  const int parent = parents_[bone];
  return parent >= 0 && seen_markers_[static_cast<std::size_t>(parent)] > 0 &&
         body_.told_by_markers(bone) != BodyFollower::Told::No;
}

float SubjectSolver::confidence_of(std::size_t bone) const {
  if (!told_) return 0.0F;
  const double place_m2 = body_.pose().joint_covariance(bone).trace() / 3.0;
  const double turn_rad2 = !turn_shows_[bone] ? 0.0 : body_.pose().turn_covariance(bone).trace() / 3.0;
  const double sigma_m =
      std::sqrt(place_m2 + kLever_m * kLever_m * 2.0 / 3.0 * turn_rad2 + std::pow(body_.residual_m(), 2) / 3.0);
  return std::isfinite(sigma_m) ? static_cast<float>(within(kNear_m, sigma_m)) : 0.0F;
}

void SubjectSolver::show_motion(BoneMemory& memory, const Eigen::Quaterniond& turned_from, double step_s,
                                BonePose& bone) const {
  const Pose& now = bone.world_from_bone;
  if (fresh_ || step_s > kLongGap_s) {
    memory.velocity_m_s.setZero();
    memory.spin_rad_s.setZero();
  } else if (step_s > 0.0) {
    const double share = 1.0 - std::exp(-step_s / kVelocity_s);
    const Eigen::Vector3d turned = kinematics::rotation_vector(now.rotation * turned_from.conjugate());
    memory.velocity_m_s += share * ((now.position - memory.position) / step_s - memory.velocity_m_s);
    memory.spin_rad_s += share * (turned / step_s - memory.spin_rad_s);
  }
  memory.position = now.position;
  bone.velocity_m_s = memory.velocity_m_s;
  bone.spin_rad_s = memory.spin_rad_s;
}

void SubjectSolver::show(Timestamp at, SubjectPose& into) {
  const double step_s = fresh_ ? 0.0 : to_s(at - shown_at_);
  find_changes(at);
  if (fresh_ || step_s > kLongGap_s) {
    easer_.reset();
    smoother_.reset();
  }
  if (refitted_) std::fill(changed_.begin(), changed_.end(), std::uint8_t{1});
  const std::span<const Pose> before = refitted_ ? std::span<const Pose>(as_before_) : body_.foreseen();
  const std::span<const Pose> eased = easer_.step(body_.pose().locals(), before, changed_, step_s);
  refitted_ = false;
  const std::span<const Pose> locals = smoother_.step(eased, step_s);
  into.residual_m = body_.residual_m();
  into.smoothing_delay_s = smoother_.delay_s();
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& memory = bones_[b];
    world_[b] = parents_[b] < 0 ? locals[b] : world_[static_cast<std::size_t>(parents_[b])] * locals[b];
    world_[b].rotation.normalize();
    const Eigen::Quaterniond turned_from = memory.shown_world;
    memory.shown_world = kinematics::same_side(world_[b].rotation, memory.shown_world);
    memory.shown_local = kinematics::same_side(locals[b].rotation, memory.shown_local);
    BonePose& bone = into.bones.push_back({});
    bone.world_from_bone = {world_[b].position, memory.shown_world};
    bone.parent_from_bone = {locals[b].position, memory.shown_local};
    show_motion(memory, turned_from, step_s, bone);
    bone.state = bone_seen(b) ? BoneState::Measured : BoneState::Filled;
    if (bone.state == BoneState::Measured) memory.seen_at = at;
    bone.confidence = confidence_of(b);
  }
  shown_at_ = at;
  fresh_ = false;
}

// How surely the body tells each marker: what was seen, by the fit; the rest by what hangs between.
void SubjectSolver::judge_places(Timestamp at) {
  told_ = body_.weigh(seen_, at);
  const Eigen::Matrix3d residual = std::pow(body_.residual_m(), 2) * Eigen::Matrix3d::Identity();
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    if (how_seen_[m] == Seen::Measured) {
      covariances_m2_[m] = kLeastSigma_m * kLeastSigma_m * Eigen::Matrix3d::Identity() + residual;
      continue;
    }
    covariances_m2_[m].setIdentity();
    if (told_) covariances_m2_[m] = body_.told_covariance(m) + residual;
    const double most = covariances_m2_[m].trace() / (kMostSigma_m * kMostSigma_m);
    if (!(most < 1.0)) covariances_m2_[m] /= most;
    if (!covariances_m2_[m].allFinite()) covariances_m2_[m] = std::pow(kMostSigma_m, 2) * Eigen::Matrix3d::Identity();
  }
}

void SubjectSolver::fill(SubjectLabels& labels, Timestamp at) {
  for (std::size_t m = 0; m < labels.markers.size() && m < how_seen_.size(); ++m) {
    LabelledMarker& label = labels.markers[m];
    if (label.state == LabelState::Measured) continue;
    const double unseen_s = body_.unseen_s(m, at);
    const NamedRay* const ray = ray_of_[m];
    if (ray == nullptr && unseen_s > settings_.fill_for_s) {
      label.state = LabelState::Lost;
      label.confidence = 0.0F;
      continue;
    }
    label.state = LabelState::Filled;
    label.position.v = body_.told(m);
    label.covariance_m2 = covariances_m2_[m];
    label.residual_px = 0.0;
    label.cameras = 0;
    label.confidence = kByRay * static_cast<float>(std::exp(-unseen_s));
    if (ray == nullptr) continue;
    const Eigen::Vector3d& d = ray->direction;
    const double depth_m = (label.position.v - ray->eye.v).dot(d);
    label.position.v = ray->eye.v + depth_m * d;
    const double along_m2 = d.dot(label.covariance_m2 * d);
    const double across_m2 = std::pow(ray->sigma_rad * depth_m, 2);
    label.covariance_m2 = across_m2 * Eigen::Matrix3d::Identity() + (along_m2 - across_m2) * d * d.transpose();
    label.cameras = 1;
    label.confidence = kByRay;
  }
}

void SubjectSolver::begin_anew(Timestamp at) {
  for (BoneMemory& bone : bones_) bone.seen_at = at;
  for (RayMemory& ray : rays_) ray.sets = 0;
  usual_residual_m_ = skin_sigma_m_ = settings_.marker_sigma_m;
  skin_at_ = at;
  fresh_ = true;
}

void SubjectSolver::solve(SubjectLabels& labels, std::span<const NamedRay> rays,
                          std::span<const SurmisedMarker> surmised, Timestamp at, SubjectPose& into) {
  into.bones.clear();
  into.residual_m = 0.0;
  into.smoothing_delay_s = 0.0;
  if (labels.phase != SubjectPhase::Tracking) {
    body_.forget();
    if (const std::optional<SubjectFit> fit = std::exchange(refit_, std::nullopt)) refit(*fit);
    return;
  }
  gather(labels, at);
  if (!body_.following() || at < body_.learnt_at()) {
    if (!body_.start(seen_, at)) return;
    begin_anew(at);
  } else {
    body_.predict(at);
    gather_rays(labels.subject, rays, at);
    gather_surmised(labels.subject, surmised);
    (void)body_.fit(seen_);
    if (refit_) wear_refit();
    body_.learn(seen_);
    learn_skin(at);
  }
  judge_places(at);
  show(at, into);
  fill(labels, at);
}

void SubjectSolver::predict(SubjectId id, Timestamp at, Expected& into) {
  if (!body_.following()) return;
  body_.predict(at);
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    const Label label{id, static_cast<std::uint32_t>(m)};
    if (!into.markers.try_push_back({{body_.told(m)}, covariances_m2_[m], {}, label, 0})) return;
  }
}

}  // namespace mocap::solve
