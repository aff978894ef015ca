#include "paper_study/paper_kalman.h"

#include <Eigen/LU>
#include <cmath>

namespace mocap::paper_study {
namespace {

constexpr double kBirthVariance = 100.0;
constexpr double kFirstNoise = 0.2;
constexpr double kNoise = 0.06;
constexpr double kNoisePerSpeed = 0.013;
constexpr double kGatePerSigma = 100.0;

}  // namespace

PaperKalman::PaperKalman(const PaperImage& image, const filter::Seen<2>& first)
    : image_(image),
      state_(first.point.x(), first.point.y(), 0.0, 0.0),
      covariance_(Eigen::Vector4d(0.0, 0.0, kBirthVariance, kBirthVariance).asDiagonal()),
      noise_(kFirstNoise, kFirstNoise),
      predicted_(first.point),
      shown_(first.point),
      velocity_sigma_(std::sqrt(kBirthVariance)) {}

void PaperKalman::predict(double) {
  Eigen::Matrix4d transition = Eigen::Matrix4d::Identity();
  transition.topRightCorner<2, 2>().setIdentity();
  const filter::Vector<2> known_velocity = state_.tail<2>();
  state_ = (transition * state_).eval();
  covariance_ = (transition * covariance_ * transition.transpose()).eval();
  covariance_.diagonal().tail<2>() += noise_;
  velocity_sigma_ = 0.5 * (std::sqrt(covariance_(2, 2)) + std::sqrt(covariance_(3, 3)));
  predicted_ = image_.clamped({std::trunc(state_[0]), std::trunc(state_[1])});
  shown_ = predicted_;
  noise_ = (kNoise + kNoisePerSpeed * known_velocity.array().abs()).matrix();  // process noise of the next step
}

double PaperKalman::radius_px() const { return std::trunc(kGatePerSigma * velocity_sigma_); }

void PaperKalman::correct(const filter::Vector<2>& point) {
  filter::Matrix<2> noise;
  noise << 0.2845, 0.0045, 0.0045, 0.0455;
  const Eigen::Matrix<double, 4, 2> gain =
      covariance_.leftCols<2>() * (covariance_.topLeftCorner<2, 2>() + noise).inverse();
  state_ += (gain * (point - state_.head<2>())).eval();
  covariance_ = (covariance_ - gain * covariance_.topRows<2>()).eval();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();  // keep the matrix symmetric despite rounding
  shown_ = point;
}

}  // namespace mocap::paper_study
