#include "body/pose_fit.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "body/rotation.h"

namespace mocap::body {
namespace {

// A step that moves no joint by more than this (m, rad) is not worth another: a hundredth of a marker's noise.
constexpr double kSmallStep = 1e-5;
constexpr double kFirstDamping = 1e-6;
constexpr double kMostDamping = 1e3;

double squared(double x) { return x * x; }

// Geman and McClure's robust cost of a residual of squared length s, in m^2, and its weight.
double robust(double s, double c) { return s * squared(c) / (squared(c) + s); }
double robust_weight(double s, double c) { return squared(squared(c) / (squared(c) + s)); }

// How far a joint's rotation vector is beyond its range; an axis without range counts as one that does not turn.
Eigen::Vector3d beyond_limits(const Bone& bone, const Eigen::Vector3d& phi) {
  Eigen::Vector3d beyond;
  for (int axis = 0; axis < 3; ++axis) {
    const auto range = bone.turns[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
    beyond[axis] = phi[axis] - std::clamp(phi[axis], range.min_rad, range.max_rad);
  }
  return beyond;
}

// One over the variance of each axis of a joint from rest: a joint that hardly turns is hardly turned.
Eigen::Vector3d rest_weight(const Bone& bone, const PosePrior& prior) {
  Eigen::Vector3d weight = Eigen::Vector3d::Constant(1.0 / squared(prior.rest_sigma_rad));
  if (prior.rest_share <= 0.0) return weight;
  for (int axis = 0; axis < 3; ++axis) {
    const auto range = bone.turns[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
    const double widest = std::max({-range.min_rad, range.max_rad, prior.limit_sigma_rad});
    weight[axis] = std::max(weight[axis], 1.0 / squared(prior.rest_share * widest));
  }
  return weight;
}

// The weight of a bone's place about its model's: along it by its stretch, across by its bend.
Eigen::Matrix3d place_weight(const Eigen::Vector3d& model, const PosePrior& prior) {
  const double length = model.norm();
  const double across = 1.0 / squared(prior.bend_sigma_m);
  if (length < 1e-6) return across * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = model / length;
  const double along = 1.0 / squared(prior.stretch_sigma * length);
  return across * Eigen::Matrix3d::Identity() + (along - across) * u * u.transpose();
}

std::vector<int> unknowns_above(const Skeleton& skeleton, PoseFit::Lengths lengths) {
  std::vector<int> parents;
  std::vector<int> last(skeleton.bones.size());
  for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
    const int parent = skeleton.bones[b].parent;
    int above = parent < 0 ? -1 : last[static_cast<std::size_t>(parent)];
    const int count = parent < 0 || lengths == PoseFit::Lengths::Free ? 6 : 3;
    for (int i = 0; i < count; ++i) {
      parents.push_back(above);
      above = static_cast<int>(parents.size()) - 1;
    }
    last[b] = above;
  }
  return parents;
}

}  // namespace

PoseFit::PoseFit(const MarkerSet& set, Lengths lengths) : set_(set), equations_(unknowns_above(set.skeleton, lengths)) {
  const std::size_t bones = set_.skeleton.bones.size();
  int next = 0;
  for (std::size_t b = 0; b < bones; ++b) {
    const int parent = set_.skeleton.bones[b].parent;
    MOCAP_EXPECTS(parent < static_cast<int>(b));
    const bool moves = parent < 0 || lengths == Lengths::Free;
    place_unknown_.push_back(moves ? next : -1);
    next += moves ? 3 : 0;
    turn_unknown_.push_back(next);
    next += 3;
    Chain chain = parent < 0 ? Chain{} : chains_[static_cast<std::size_t>(parent)];
    for (int i = place_unknown_[b] < 0 ? turn_unknown_[b] : place_unknown_[b]; i < next; ++i) {
      chain.unknowns.push_back(i);
      chain.bones.push_back(static_cast<int>(b));
    }
    chains_.push_back(std::move(chain));
    model_places_.push_back(set_.skeleton.bones[b].rest_offset_m);
  }
  for (const MarkerOnBone& marker : set_.markers)
    MOCAP_EXPECTS(marker.bone >= 0 && marker.bone < static_cast<int>(bones));
  locals_.resize(bones);
  world_.resize(bones);
  before_.resize(bones);
  kept_.resize(bones);
  step_.resize(equations_.size());
  columns_.resize(equations_.size());
  row_.resize(equations_.size());
  place({});
}

void PoseFit::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                    std::span<const Eigen::Vector3d> marker_offsets_m) {
  MOCAP_EXPECTS(rest_offsets_m.size() == locals_.size() && marker_offsets_m.size() == set_.markers.size());
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    set_.skeleton.bones[b].rest_offset_m = rest_offsets_m[b];
    model_places_[b] = rest_offsets_m[b];
    if (set_.skeleton.bones[b].parent >= 0) locals_[b].position = rest_offsets_m[b];
  }
  for (std::size_t m = 0; m < set_.markers.size(); ++m) set_.markers[m].offset_m = marker_offsets_m[m];
  scale_ = 1.0;
  update_world();
}

void PoseFit::place(const Pose& world_from_root, double scale) {
  scale_ = scale;
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    model_places_[b] = scale * set_.skeleton.bones[b].rest_offset_m;
    locals_[b] = set_.skeleton.bones[b].parent < 0 ? world_from_root : Pose{model_places_[b], identity_};
  }
  update_world();
}

void PoseFit::set_locals(std::span<const Pose> locals) {
  MOCAP_EXPECTS(locals.size() == locals_.size());
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    if (set_.skeleton.bones[b].parent < 0) locals_[b].position = locals[b].position;
    locals_[b].rotation = locals[b].rotation;
  }
  update_world();
}

Eigen::Vector3d PoseFit::marker_at(std::size_t marker) const {
  const MarkerOnBone& on = set_.markers[marker];
  return world_[static_cast<std::size_t>(on.bone)] * (scale_ * on.offset_m);
}

const Eigen::Quaterniond& PoseFit::parent_rotation(std::size_t bone) const {
  const int parent = set_.skeleton.bones[bone].parent;
  return parent < 0 ? identity_ : world_[static_cast<std::size_t>(parent)].rotation;
}

void PoseFit::update_world() {
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    const int parent = set_.skeleton.bones[b].parent;
    world_[b] = parent < 0 ? locals_[b] : world_[static_cast<std::size_t>(parent)] * locals_[b];
    world_[b].rotation.normalize();
  }
}

double PoseFit::cost_of(std::span<const Observation> seen, const PosePrior& prior) const {
  double sum = 0.0;
  for (const Observation& one : seen) {
    if (!one.position.allFinite()) continue;
    const double off = (marker_at(static_cast<std::size_t>(one.marker)) - one.position).squaredNorm();
    sum += robust(off, prior.outlier_m) / squared(one.sigma_m);
  }
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    const bool root = set_.skeleton.bones[b].parent < 0;
    if (!root) {
      const Eigen::Vector3d phi = rotation_vector(locals_[b].rotation);
      sum += rest_weight(set_.skeleton.bones[b], prior).dot(phi.cwiseAbs2());
      sum += beyond_limits(set_.skeleton.bones[b], phi).squaredNorm() / squared(prior.limit_sigma_rad);
    }
    if (!prior.hold_sigma_rad.empty()) {
      const Eigen::Vector3d moved = rotation_vector(locals_[b].rotation * before_[b].rotation.conjugate());
      sum += moved.squaredNorm() / squared(prior.hold_sigma_rad[b]);
      if (root) sum += (locals_[b].position - before_[b].position).squaredNorm() / squared(prior.hold_root_sigma_m);
    }
    if (!root && place_unknown_[b] >= 0) {
      const Eigen::Vector3d off = locals_[b].position - model_places_[b];
      sum += off.dot(place_weight(model_places_[b], prior) * off);
    }
  }
  return 0.5 * sum;
}

// Unknowns are small moves and turns in the world's axes: a point at lever l from a joint moves by turn x l.
void PoseFit::fill_columns(const Chain& chain, const Eigen::Vector3d& point) {
  for (std::size_t i = 0; i < chain.unknowns.size(); ++i) {
    const auto above = static_cast<std::size_t>(chain.bones[i]);
    const int turn_axis = chain.unknowns[i] - turn_unknown_[above];
    if (turn_axis >= 0) {
      columns_[i] = Eigen::Vector3d::Unit(turn_axis).cross(point - world_[above].position);
    } else {
      columns_[i] = Eigen::Vector3d::Unit(chain.unknowns[i] - place_unknown_[above]);
    }
  }
}

void PoseFit::add_marker(const Observation& seen, const PosePrior& prior) {
  const auto bone = static_cast<std::size_t>(set_.markers[static_cast<std::size_t>(seen.marker)].bone);
  const Eigen::Vector3d point = marker_at(static_cast<std::size_t>(seen.marker));
  const Eigen::Vector3d off = point - seen.position;
  const double weight = robust_weight(off.squaredNorm(), prior.outlier_m) / squared(seen.sigma_m);
  const Chain& chain = chains_[bone];
  fill_columns(chain, point);
  for (std::size_t i = 0; i < chain.unknowns.size(); ++i) {
    const auto lower = static_cast<std::size_t>(chain.unknowns[i]);
    equations_.add_right(lower, -weight * columns_[i].dot(off));
    for (std::size_t j = 0; j <= i; ++j) {
      equations_.add(lower, static_cast<std::size_t>(chain.unknowns[j]), weight * columns_[i].dot(columns_[j]));
    }
  }
}

// A prior's weight and gradient, given in the frame of the bone's parent.
void PoseFit::add_block(std::size_t first_unknown, const Eigen::Matrix3d& weight, const Eigen::Vector3d& gradient,
                        std::size_t bone) {
  const Eigen::Matrix3d turned = parent_rotation(bone).toRotationMatrix();
  const Eigen::Matrix3d in_world = turned * weight * turned.transpose();
  const Eigen::Vector3d right = turned * gradient;
  for (int i = 0; i < 3; ++i) {
    equations_.add_right(first_unknown + static_cast<std::size_t>(i), -right[i]);
    for (int j = 0; j <= i; ++j) {
      equations_.add(first_unknown + static_cast<std::size_t>(i), first_unknown + static_cast<std::size_t>(j),
                     in_world(i, j));
    }
  }
}

void PoseFit::add_rotation_prior(std::size_t bone, const PosePrior& prior) {
  Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  if (set_.skeleton.bones[bone].parent >= 0) {
    const Eigen::Vector3d phi = rotation_vector(locals_[bone].rotation);
    const Eigen::Vector3d beyond = beyond_limits(set_.skeleton.bones[bone], phi);
    const double limit = 1.0 / squared(prior.limit_sigma_rad);
    Eigen::Vector3d by_axis = rest_weight(set_.skeleton.bones[bone], prior);
    Eigen::Vector3d pull = by_axis.cwiseProduct(phi) + limit * beyond;
    for (int axis = 0; axis < 3; ++axis) by_axis[axis] += beyond[axis] == 0.0 ? 0.0 : limit;
    const Eigen::Matrix3d change = change_of_rotation_vector(phi);
    weight = change.transpose() * by_axis.asDiagonal() * change;
    gradient = change.transpose() * pull;
  }
  if (!prior.hold_sigma_rad.empty()) {
    const double hold = 1.0 / squared(prior.hold_sigma_rad[bone]);
    const Eigen::Vector3d moved = rotation_vector(locals_[bone].rotation * before_[bone].rotation.conjugate());
    const Eigen::Matrix3d change = change_of_rotation_vector(moved);
    weight += hold * change.transpose() * change;
    gradient += hold * moved;
  }
  add_block(static_cast<std::size_t>(turn_unknown_[bone]), weight, gradient, bone);
}

void PoseFit::add_place_prior(std::size_t bone, const PosePrior& prior) {
  if (place_unknown_[bone] < 0) return;
  const auto first = static_cast<std::size_t>(place_unknown_[bone]);
  if (set_.skeleton.bones[bone].parent >= 0) {
    const Eigen::Matrix3d weight = place_weight(model_places_[bone], prior);
    add_block(first, weight, weight * (locals_[bone].position - model_places_[bone]), bone);
  } else if (!prior.hold_sigma_rad.empty()) {
    const double hold = 1.0 / squared(prior.hold_root_sigma_m);
    add_block(first, hold * Eigen::Matrix3d::Identity(), hold * (locals_[bone].position - before_[bone].position),
              bone);
  }
}

void PoseFit::step(std::span<const double> by) {
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    // world_ is still of the pose before the step, as the unknowns are.
    const Eigen::Quaterniond to_parent = parent_rotation(b).conjugate();
    if (place_unknown_[b] >= 0) {
      const double* place = by.data() + place_unknown_[b];
      locals_[b].position += to_parent * Eigen::Vector3d(place[0], place[1], place[2]);
    }
    const double* turn = by.data() + turn_unknown_[b];
    const Eigen::Vector3d turned = to_parent * Eigen::Vector3d(turn[0], turn[1], turn[2]);
    locals_[b].rotation = (turn_by(turned) * locals_[b].rotation).normalized();
  }
  update_world();
}

double PoseFit::rms_of(std::span<const Observation> seen) const {
  double sum = 0.0;
  int count = 0;
  for (const Observation& one : seen) {
    if (!one.position.allFinite()) continue;
    sum += (marker_at(static_cast<std::size_t>(one.marker)) - one.position).squaredNorm();
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / count);
}

void PoseFit::add_all(std::span<const Observation> seen, const PosePrior& prior) {
  equations_.clear();
  for (const Observation& one : seen) {
    if (one.position.allFinite()) add_marker(one, prior);
  }
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    add_rotation_prior(b, prior);
    add_place_prior(b, prior);
  }
}

bool PoseFit::weigh(std::span<const Observation> seen, const PosePrior& prior) {
  std::copy(locals_.begin(), locals_.end(), before_.begin());
  add_all(seen, prior);
  return equations_.factor();
}

Eigen::Matrix3d PoseFit::covariance_of(std::size_t marker) {
  const Chain& chain = chains_[static_cast<std::size_t>(set_.markers[marker].bone)];
  const std::size_t n = chain.unknowns.size();
  fill_columns(chain, marker_at(marker));
  for (int axis = 0; axis < 3; ++axis) {
    const auto row = std::span(row_).first(n);
    for (std::size_t i = 0; i < n; ++i) row[i] = columns_[i][axis];
    equations_.whiten(chain.unknowns, row);
    for (std::size_t i = 0; i < n; ++i) columns_[i][axis] = row[i];
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < n; ++i) covariance += columns_[i] * columns_[i].transpose();
  return covariance;
}

PoseFitResult PoseFit::solve(std::span<const Observation> seen, const PosePrior& prior, int max_iterations) {
  MOCAP_EXPECTS(prior.hold_sigma_rad.empty() || prior.hold_sigma_rad.size() == locals_.size());
  std::copy(locals_.begin(), locals_.end(), before_.begin());
  PoseFitResult result;
  result.cost = cost_of(seen, prior);
  double damping = kFirstDamping;
  while (result.iterations < max_iterations && !result.settled) {
    ++result.iterations;
    add_all(seen, prior);
    bool better = false;
    while (!better && damping <= kMostDamping) {
      std::copy(locals_.begin(), locals_.end(), kept_.begin());
      if (equations_.solve(damping, step_)) {
        step(step_);
        const double cost = cost_of(seen, prior);
        better = cost <= result.cost;  // false for nan, too
        if (better) result.cost = cost;
      }
      if (!better) {
        std::copy(kept_.begin(), kept_.end(), locals_.begin());
        update_world();
        damping *= 10.0;
      }
    }
    damping = std::max(kFirstDamping, damping * 0.1);
    const bool small = std::all_of(step_.begin(), step_.end(), [](double by) { return std::abs(by) < kSmallStep; });
    result.settled = !better || small;
  }
  result.rms_m = rms_of(seen);
  return result;
}

}  // namespace mocap::body
