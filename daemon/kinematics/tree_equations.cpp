#include "kinematics/tree_equations.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <utility>

#include "base/expects.h"
#include "kinematics/algebra.h"

namespace mocap::kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

}  // namespace

// A point at lever l moves by v - [l] w.
void BoneTerms::add_point(const Vector3d& lever, const Matrix3d& weight, const Vector3d& error) {
  const Matrix3d l = cross_matrix(lever);
  const Matrix3d weighted = weight * l;
  const Vector3d gradient = weight * error;
  vv += weight;
  vw -= weighted;
  ww.noalias() -= l * weighted;
  w += lever.cross(gradient);
  v += gradient;
}

void BoneTerms::add_point(const Vector3d& lever, double weight, const Vector3d& error) {
  const Vector3d weighted = weight * lever;
  const Vector3d gradient = weight * error;
  vv.diagonal().array() += weight;
  vw -= cross_matrix(weighted);
  ww.noalias() -= weighted * lever.transpose();
  ww.diagonal().array() += weighted.dot(lever);
  w += lever.cross(gradient);
  v += gradient;
}

TreeEquations::TreeEquations(std::vector<Link> links) : links_(std::move(links)) {
  const std::size_t n = links_.size();
  for (std::size_t i = 0; i < n; ++i) MOCAP_EXPECTS(links_[i].parent < static_cast<int>(i));
  joints_.resize(n, Vector3d::Zero());
  bones_.resize(n);
  rotation_terms_.resize(n);
  translation_terms_.resize(n);
  subtree_terms_.resize(n);
  eliminated_rotations_.resize(n);
  eliminated_translations_.resize(n);
  rotation_steps_.resize(n, Vector3d::Zero());
  translation_steps_.resize(n, Vector3d::Zero());
  w_.resize(n);
  v_.resize(n);
  covariances_.resize(n);
  joint_rotation_covariances_.resize(n, Matrix3d::Zero());
}

// Adds prior and damping to the information matrix in `inverse`, inverts it, and subtracts the prior's gradient from
// the right side. False if the matrix is not positive definite.
//
// Inverted by its factors L D L^T: one marker far out on a limb gives one direction a million times the information of
// the others, and an inverse by quotients of minors loses the small information of those (decision 0003).
bool TreeEquations::invert_information(Eliminated& eliminated, const JointTerms& terms, double damping,
                                       double min_information) {
  Matrix3d m = eliminated.inverse + terms.weight;
  m.diagonal() += damping * (m.diagonal().array() + 1.0).matrix();
  m.diagonal().array() += min_information;
  const double l10 = m(1, 0) / m(0, 0), l20 = m(2, 0) / m(0, 0);
  const double d1 = m(1, 1) - l10 * m(1, 0);
  const double d1_l21 = m(2, 1) - l20 * m(1, 0);
  const double l21 = d1_l21 / d1;
  const double d2 = m(2, 2) - l20 * m(2, 0) - l21 * d1_l21;
  if (!(m(0, 0) > 0.0 && d1 > 0.0 && d2 > 0.0)) return false;
  const double i0 = 1.0 / m(0, 0), i1 = 1.0 / d1, i2 = 1.0 / d2;
  const double l_inverse20 = l10 * l21 - l20;
  Matrix3d& inverse = eliminated.inverse;
  inverse(0, 0) = i0 + l10 * l10 * i1 + l_inverse20 * l_inverse20 * i2;
  inverse(0, 1) = inverse(1, 0) = -l10 * i1 - l_inverse20 * l21 * i2;
  inverse(0, 2) = inverse(2, 0) = l_inverse20 * i2;
  inverse(1, 1) = i1 + l21 * l21 * i2;
  inverse(1, 2) = inverse(2, 1) = -l21 * i2;
  inverse(2, 2) = i2;
  eliminated.right -= terms.gradient;
  return inverse.allFinite();
}

void TreeEquations::apply_schur_complement(BoneTerms& bone, const Eliminated& eliminated) {
  const Matrix3d kw = eliminated.w * eliminated.inverse;
  const Matrix3d kv = eliminated.v * eliminated.inverse;
  bone.ww.noalias() -= kw * eliminated.w.transpose();
  bone.vw.noalias() -= kv * eliminated.w.transpose();
  bone.vv.noalias() -= kv * eliminated.v.transpose();
  bone.w.noalias() += kw * eliminated.right;
  bone.v.noalias() += kv * eliminated.right;
}

// Adds the terms that remain after the joint was eliminated to the parent, about the parent's joint.
void TreeEquations::eliminate_to_parent(std::size_t link, const BoneTerms& reduced) {
  const auto parent = static_cast<std::size_t>(links_[link].parent);
  const Vector3d lever = joints_[link] - joints_[parent];
  const Matrix3d l = cross_matrix(lever);
  BoneTerms& into = subtree_terms_[parent];
  const Matrix3d vw = reduced.vw - reduced.vv * l;
  into.ww += reduced.ww;
  into.ww.noalias() -= reduced.vw.transpose() * l;
  into.ww.noalias() += l * vw;
  into.vw += vw;
  into.vv += reduced.vv;
  into.w += reduced.w + lever.cross(reduced.v);
  into.v += reduced.v;
}

bool TreeEquations::eliminate(double damping, double min_information) {
  for (std::size_t i = 0; i < size(); ++i) subtree_terms_[i] = bones_[i];
  for (std::size_t i = size(); i-- > 0;) {
    BoneTerms& bone = subtree_terms_[i];
    Eliminated& rotation = eliminated_rotations_[i];
    const Matrix3d& axes = rotation_terms_[i].axes;
    rotation.w.noalias() = bone.ww * axes;
    rotation.v.noalias() = bone.vw * axes;
    rotation.inverse.noalias() = axes.transpose() * rotation.w;
    rotation.right.noalias() = -(axes.transpose() * bone.w);
    if (!invert_information(rotation, rotation_terms_[i], damping, min_information)) return false;
    apply_schur_complement(bone, rotation);
    if (links_[i].has_translation) {
      Eliminated& translation = eliminated_translations_[i];
      const Matrix3d& translation_axes = translation_terms_[i].axes;
      translation.w.noalias() = bone.vw.transpose() * translation_axes;
      translation.v.noalias() = bone.vv * translation_axes;
      translation.inverse.noalias() = translation_axes.transpose() * translation.v;
      translation.right.noalias() = -(translation_axes.transpose() * bone.v);
      if (!invert_information(translation, translation_terms_[i], damping, min_information)) return false;
      if (links_[i].parent >= 0) apply_schur_complement(bone, translation);
    }
    if (links_[i].parent >= 0) eliminate_to_parent(i, bone);
  }
  return true;
}

bool TreeEquations::solve(double damping) {
  if (!eliminate(damping, damping)) return false;
  bool finite = true;
  for (std::size_t i = 0; i < size(); ++i) {
    w_[i].setZero();
    v_[i].setZero();
    if (links_[i].parent >= 0) {
      const auto parent = static_cast<std::size_t>(links_[i].parent);
      w_[i] = w_[parent];
      v_[i] = v_[parent] + w_[parent].cross(joints_[i] - joints_[parent]);
    }
    if (links_[i].has_translation) {
      const Eliminated& translation = eliminated_translations_[i];
      translation_steps_[i] = translation.inverse * (translation.right - translation.w.transpose() * w_[i] -
                                                     translation.v.transpose() * v_[i]);
      v_[i] += translation_terms_[i].axes * translation_steps_[i];
    }
    const Eliminated& rotation = eliminated_rotations_[i];
    rotation_steps_[i] =
        rotation.inverse * (rotation.right - rotation.w.transpose() * w_[i] - rotation.v.transpose() * v_[i]);
    w_[i] += rotation_terms_[i].axes * rotation_steps_[i];
    finite = finite && rotation_steps_[i].allFinite() && translation_steps_[i].allFinite();
  }
  return finite;
}

TreeEquations::Covariance TreeEquations::marginal_covariance(std::size_t link) const {
  if (links_[link].parent < 0) return {Matrix3d::Zero(), Matrix3d::Zero(), Matrix3d::Zero()};
  const auto parent = static_cast<std::size_t>(links_[link].parent);
  const Matrix3d l = cross_matrix(joints_[link] - joints_[parent]);
  const Covariance& from = covariances_[parent];
  const Matrix3d vw = from.vw - l * from.ww;
  return {from.ww, vw, from.vv - l * from.vw.transpose() + vw * l};
}

// v becomes v - gw w - gv v, plus the uncertainty of the translation itself.
void TreeEquations::propagate_translation(std::size_t link, Covariance& c) const {
  const Eliminated& translation = eliminated_translations_[link];
  const Matrix3d& axes = translation_terms_[link].axes;
  const Matrix3d gain = axes * translation.inverse;
  const Matrix3d gw = gain * translation.w.transpose();
  const Matrix3d gv = gain * translation.v.transpose();
  const Matrix3d vw = c.vw - gw * c.ww - gv * c.vw;
  const Matrix3d with_old = c.vv - gw * c.vw.transpose() - gv * c.vv;
  c.vv = with_old - vw * gw.transpose() - with_old * gv.transpose() + gain * axes.transpose();
  c.vw = vw;
}

// The same for w and the rotation.
void TreeEquations::propagate_rotation(std::size_t link, Covariance& c) {
  const Eliminated& rotation = eliminated_rotations_[link];
  const Matrix3d& axes = rotation_terms_[link].axes;
  const Matrix3d gain_w = rotation.inverse * rotation.w.transpose();
  const Matrix3d gain_v = rotation.inverse * rotation.v.transpose();
  const Matrix3d with_w = gain_w * c.ww + gain_v * c.vw;
  const Matrix3d with_v = gain_w * c.vw.transpose() + gain_v * c.vv;
  Matrix3d& joint = joint_rotation_covariances_[link];
  joint = rotation.inverse + with_w * gain_w.transpose() + with_v * gain_v.transpose();
  const Matrix3d shared = axes * with_w;
  c.ww += axes * joint * axes.transpose() - shared - shared.transpose();
  c.vw -= (axes * with_v).transpose();
}

bool TreeEquations::compute_covariances() {
  if (!eliminate(0.0, 1e-9)) return false;
  for (std::size_t i = 0; i < size(); ++i) {
    covariances_[i] = marginal_covariance(i);
    if (links_[i].has_translation) propagate_translation(i, covariances_[i]);
    propagate_rotation(i, covariances_[i]);
  }
  return true;
}

Matrix3d TreeEquations::covariance_of(std::size_t link, const Vector3d& lever) const {
  const Matrix3d l = cross_matrix(lever);
  const Covariance& c = covariances_[link];
  const Matrix3d covariance = c.vv - l * c.vw.transpose() + (c.vw - l * c.ww) * l;
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace mocap::kinematics
