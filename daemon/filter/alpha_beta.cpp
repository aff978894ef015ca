#include "filter/alpha_beta.h"

namespace mocap::filter {

template <int N>
AlphaBeta<N>::AlphaBeta(const AlphaBetaSettings& settings, const Seen<N>& first)
    : settings_(settings), point_(first.point), velocity_(Vector<N>::Zero()) {}

template <int N>
void AlphaBeta<N>::predict(double dt_s) {
  point_ += velocity_ * dt_s;
  since_seen_s_ += dt_s;
  last_dt_s_ = dt_s;
}

template <int N>
Gate<N> AlphaBeta<N>::gate() const {
  const double sigma =
      settings_.gate_u + settings_.gate_per_speed * velocity_.norm() * last_dt_s_ + settings_.gate_per_miss_u * misses_;
  return {point_, Matrix<N>::Identity() * sigma * sigma};
}

template <int N>
void AlphaBeta<N>::update(const Seen<N>& seen) {
  const Vector<N> innovation = seen.point - point_;
  point_ += settings_.alpha * innovation;
  // The innovation accumulated since the last measurement, which may be more than one step ago.
  if (since_seen_s_ > 0.0) velocity_ += settings_.beta / since_seen_s_ * innovation;
  since_seen_s_ = 0.0;
  misses_ = 0.0;
}

template <int N>
void AlphaBeta<N>::coast() {
  misses_ += 1.0;
}

template <int N>
void AlphaBeta<N>::restart(const Vector<N>& point, const Vector<N>& velocity) {
  point_ = point;
  velocity_ = velocity;
  since_seen_s_ = 0.0;
  misses_ = 0.0;
}

template class AlphaBeta<2>;
template class AlphaBeta<3>;

}  // namespace mocap::filter
