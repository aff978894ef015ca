#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "base/archive.h"

namespace mocap::kinematics {

/// Quadratic cost of the small displacement x = (w, v) of one bone: the bone rotates by w, and its point in the joint
/// moves by v, both in the world frame. The cost is x^T H x / 2 + g^T x.
struct BoneTerms {
  Eigen::Matrix3d ww = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d vw = Eigen::Matrix3d::Zero();  ///< rows of v, columns of w
  Eigen::Matrix3d vv = Eigen::Matrix3d::Zero();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< part of the gradient
  Eigen::Vector3d v = Eigen::Vector3d::Zero();

  /// Adds a point of the bone at `lever` from the joint with the residual `error` and the information matrix `weight`,
  /// 1/m^2.
  void add_point(const Eigen::Vector3d& lever, const Eigen::Matrix3d& weight, const Eigen::Vector3d& error);
  /// The same with an isotropic weight.
  void add_point(const Eigen::Vector3d& lever, double weight, const Eigen::Vector3d& error);
};

/// The three unknowns x of a joint with their prior: x^T weight x / 2 + gradient^T x.
struct JointTerms {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< world displacement = axes * unknowns
  Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

/// Normal equations of a kinematic tree. The displacement of a bone is the displacement of its parent, plus a rotation
/// and, if the link has one, a translation in its joint. The equations are eliminated from the leaves to the root and
/// substituted back, in time linear in the number of bones. A second downward pass gives the marginal covariance of
/// each bone.
///
/// Allocates in the constructor only.
///
/// Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 7, articulated-body algorithm, with information
/// matrices in the place of inertias; covariances as in the smoother of Rauch, Tung and Striebel (1965), with the tree
/// in the place of time.
class TreeEquations {
 public:
  struct Link {
    int parent = -1;               ///< index of an earlier link; -1: attached to the world
    bool has_translation = false;  ///< three more unknowns: a translation of the joint
  };

  explicit TreeEquations(std::vector<Link> links);

  std::size_t size() const noexcept { return links_.size(); }

  /// To be set before each solve: position of the link's joint, m, and all terms.
  Eigen::Vector3d& joint(std::size_t link) { return joints_[link]; }
  BoneTerms& bone(std::size_t link) { return bones_[link]; }
  JointTerms& rotation(std::size_t link) { return rotation_terms_[link]; }
  JointTerms& translation(std::size_t link) { return translation_terms_[link]; }

  /// Solves the equations. Levenberg-Marquardt damping: the information d of each unknown becomes d + damping * (d + 1)
  /// + damping, where d includes what the elimination of the subtree left. The terms stay as they are. False if the
  /// equations are not positive definite.
  [[nodiscard]] bool solve(double damping);
  /// Results of the last `solve`.
  const Eigen::Vector3d& rotation_step(std::size_t link) const { return rotation_steps_[link]; }
  const Eigen::Vector3d& translation_step(std::size_t link) const { return translation_steps_[link]; }

  /// Prepares the covariances. False if the equations are not positive definite.
  [[nodiscard]] bool compute_covariances();
  /// By the last `compute_covariances`: of the position of a point of a bone, `lever` from its joint, m^2, and of the
  /// bone's rotation, rad^2.
  Eigen::Matrix3d covariance_of(std::size_t link, const Eigen::Vector3d& lever) const;
  const Eigen::Matrix3d& rotation_covariance(std::size_t link) const { return covariances_[link].ww; }
  /// By the last `compute_covariances`: of the joint's own rotation unknowns.
  const Eigen::Matrix3d& joint_rotation_covariance(std::size_t link) const { return joint_rotation_covariances_[link]; }

  /// Writes the last covariances, or takes them over from equations of the same links (see Archive). All else is
  /// computed anew by each solve.
  void archive(Archive& members) { members(covariances_, joint_rotation_covariances_); }

 private:
  // Eliminated unknowns as a function of the displacement (dw, dv) of the parent: x = inverse * (right - w^T dw - v^T
  // dv).
  struct Eliminated {
    Eigen::Matrix3d inverse;
    Eigen::Matrix3d w;
    Eigen::Matrix3d v;
    Eigen::Vector3d right;
  };
  struct Covariance {
    Eigen::Matrix3d ww;
    Eigen::Matrix3d vw;
    Eigen::Matrix3d vv;

    void archive(Archive& members) { members(ww, vw, vv); }
  };

  [[nodiscard]] bool eliminate(double damping, double min_information);
  [[nodiscard]] static bool invert_information(Eliminated& eliminated, const JointTerms& terms, double damping,
                                               double min_information);
  static void apply_schur_complement(BoneTerms& bone, const Eliminated& eliminated);
  void eliminate_to_parent(std::size_t link, const BoneTerms& reduced);
  Covariance marginal_covariance(std::size_t link) const;
  void propagate_translation(std::size_t link, Covariance& c) const;
  void propagate_rotation(std::size_t link, Covariance& c);

  std::vector<Link> links_;
  std::vector<Eigen::Vector3d> joints_;
  std::vector<BoneTerms> bones_;
  std::vector<JointTerms> rotation_terms_;
  std::vector<JointTerms> translation_terms_;
  std::vector<BoneTerms> subtree_terms_;  // terms of a bone and all its descendants
  std::vector<Eliminated> eliminated_rotations_;
  std::vector<Eliminated> eliminated_translations_;
  std::vector<Eigen::Vector3d> rotation_steps_;
  std::vector<Eigen::Vector3d> translation_steps_;
  std::vector<Eigen::Vector3d> w_;  // displacement of each bone
  std::vector<Eigen::Vector3d> v_;
  std::vector<Covariance> covariances_;
  std::vector<Eigen::Matrix3d> joint_rotation_covariances_;
};

}  // namespace mocap::kinematics
