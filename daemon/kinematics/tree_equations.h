#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace mocap::kinematics {

/// What is known of the small displacement (w, v) of one bone: the bone turns by w and the point of it that is in its
/// joint moves by v, both in the world. The cost is half of x^T H x + g^T x for x = (w, v).
struct BoneTerms {
  Eigen::Matrix3d ww = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d vw = Eigen::Matrix3d::Zero();  ///< rows of v, columns of w
  Eigen::Matrix3d vv = Eigen::Matrix3d::Zero();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< of the gradient
  Eigen::Vector3d v = Eigen::Vector3d::Zero();

  /// A point of the bone, `lever` from the joint, is `off` from where it should be, of which `weight` is the
  /// information, 1/m^2.
  void add_point(const Eigen::Vector3d& lever, const Eigen::Matrix3d& weight, const Eigen::Vector3d& off);
  /// The same where the weight is alike in all directions.
  void add_point(const Eigen::Vector3d& lever, double weight, const Eigen::Vector3d& off);
};

/// Three unknowns of a joint, and what is known of them beforehand: half of x^T weight x, and pull^T x.
struct JointTerms {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< the world's from the unknowns
  Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

/// Normal equations of bones that hang in a tree: each bone's displacement is its parent's and what its joint adds, a
/// turn and, where it may, a move. Eliminated from the leaves to the root and back, in time that grows with the number
/// of bones alone; a second way down gives how surely each bone is known.
///
/// Allocates in the constructor only.
///
/// Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.2, articulated bodies; covariances as in
/// Rauch, Tung and Striebel's smoother, the tree in place of time.
class TreeEquations {
 public:
  struct Link {
    int parent = -1;               ///< stands before this one; -1: hangs from the world
    bool has_translation = false;  ///< has three unknowns more, of its joint's place
  };

  explicit TreeEquations(std::vector<Link> links);

  std::size_t size() const noexcept { return links_.size(); }

  /// To be set before each solve: where the bone's joint is, m, and all that is known.
  Eigen::Vector3d& joint(std::size_t link) { return joints_[link]; }
  BoneTerms& bone(std::size_t link) { return bones_[link]; }
  JointTerms& rotation(std::size_t link) { return rotation_terms_[link]; }
  JointTerms& place(std::size_t link) { return translation_terms_[link]; }

  /// Solves with each unknown's own information made larger by `damping` times (itself and 1). The terms stay as they
  /// are. False when they do not tell the unknowns.
  [[nodiscard]] bool solve(double damping);
  /// Of the last `solve`.
  const Eigen::Vector3d& rotation_step(std::size_t link) const { return rotation_steps_[link]; }
  const Eigen::Vector3d& translation_step(std::size_t link) const { return translation_steps_[link]; }

  /// Prepares the covariances. False when the terms do not tell the unknowns.
  [[nodiscard]] bool compute_covariances();
  /// By the last `compute_covariances`: of the place of a bone's point, `lever` from its joint, m^2, and of its turn,
  /// rad^2.
  Eigen::Matrix3d covariance_of(std::size_t link, const Eigen::Vector3d& lever) const;
  const Eigen::Matrix3d& rotation_covariance(std::size_t link) const { return covariances_[link].ww; }
  /// Likewise of the joint's own unknowns.
  const Eigen::Matrix3d& joint_rotation_covariance(std::size_t link) const { return joint_rotation_covariances_[link]; }

 private:
  // Unknowns that were solved for in terms of the displacement that is left: x = inverse * (right - w^T dw - v^T dv).
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
  std::vector<BoneTerms> subtree_terms_;  // of a bone and all that hangs from it
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
