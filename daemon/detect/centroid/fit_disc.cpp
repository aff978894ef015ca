#include "detect/centroid/fit_disc.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace mocap::detect {
namespace {

constexpr int kUnknowns = 5;  // x, y, radius, and the relative changes of edge and height
using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

constexpr int kMaxRounds = 10;
constexpr double kConvergedShare = 0.95;  // least ratio of the sum of squares to the one before the last step
constexpr double kConverged_px = 1e-3;    // convergence is quadratic: the next step would be about 1e-6 px
constexpr double kMaxShift_px = 1.0;
constexpr double kMaxRelativeShift = 0.3;  // of the radius
constexpr std::size_t kMaxRim = 2048;
constexpr double kOutside_px = 5.0;  // the light of the rim reaches at most this far outside the initial radius
constexpr double kDarkOverNoise = 3.0;
// Prior of edge and height. If saturation hides nearly all of the rim, the pixels do not determine both.
constexpr double kPriorEdge_px = 0.65;
constexpr double kEdgeSigmaShare = 0.5;
constexpr double kHeightSigmaShare = 0.7;
constexpr double kLeastEdge_px = 0.25;
constexpr double kMostEdge_px = 3.0;
// Standard deviation of the model error, as a share of the range: pixels are squares, and the blur is not Gaussian. A
// disc that motion elongates by a fifth has residuals more than three times as large.
constexpr double kModelError = 0.012;
constexpr double kWorstModelError = 0.04;

// Four numbers in a vector (an extension of GCC and Clang). The file is compiled once, without fused operations, so
// that every processor computes the same sums.
constexpr std::size_t kLanes = 4;
using Floats = float __attribute__((vector_size(16)));
using Mask = decltype(Floats{} < Floats{});

Floats all_of(double value) { return Floats{} + static_cast<float>(value); }
Floats loaded(const float* from) {
  Floats v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}
Floats where(Mask mask, Floats v) { return mask ? v : Floats{}; }
Floats least(Floats a, Floats b) { return a < b ? a : b; }
Floats root(Floats v) { return Floats{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])}; }
double sum_of(Floats v) { return (static_cast<double>(v[0]) + v[1]) + (static_cast<double>(v[2]) + v[3]); }

/// The pixels around the rim, with coordinates relative to the initial centre. Padded to whole vectors with a grey
/// level of -1.
struct Rim {
  std::size_t size = 0;
  alignas(16) std::array<float, kMaxRim> x;
  alignas(16) std::array<float, kMaxRim> y;
  alignas(16) std::array<float, kMaxRim> grey;

  void add(float at_x, float at_y, float value) {
    x[size] = at_x;
    y[size] = at_y;
    grey[size] = value;
    ++size;
  }
};

/// Gathers the pixels of the rim: those that are neither dark nor saturated, and their neighbours.
void gather_rim(const Box& box, int width_px, const DiscFitLevels& levels, const SoftDisc& start, Rim& rim) {
  const double most = start.radius_px + kOutside_px;
  const auto top = levels.top;
  const auto low = static_cast<std::uint32_t>(std::max(0.0, levels.background + kDarkOverNoise * levels.noise));
  const int begin_x = std::max(0, static_cast<int>(start.x - most)),
            begin_y = std::max(0, static_cast<int>(start.y - most));
  const int end_x = std::min(width_px, static_cast<int>(start.x + most) + 2);
  const int end_y = std::min(box.height_px, static_cast<int>(start.y + most) + 2);
  const auto grey_at = [&](int x, int y) -> std::uint32_t { return box.pixels[y * box.width_px + x]; };
  for (int y = begin_y; y < end_y; ++y) {
    for (int x = begin_x; x < end_x; ++x) {
      const std::uint32_t grey = grey_at(x, y);
      if (grey == 0) continue;
      const std::uint32_t left = grey_at(std::max(0, x - 1), y), right = grey_at(std::min(width_px - 1, x + 1), y);
      const std::uint32_t above = grey_at(x, std::max(0, y - 1)),
                          below = grey_at(x, std::min(box.height_px - 1, y + 1));
      const std::uint32_t darkest = std::min({left, right, above, below, grey});
      const std::uint32_t brightest = std::max({left, right, above, below, grey});
      if (darkest >= top || brightest <= low) continue;
      if (rim.size == kMaxRim) return;
      rim.add(static_cast<float>(x - start.x), static_cast<float>(y - start.y), static_cast<float>(grey));
    }
  }
  while (rim.size % kLanes != 0) rim.add(0.0F, 0.0F, -1.0F);
}

/// The normal equations of the fit.
struct Normals {
  Matrix matrix = Matrix::Zero();
  Vector rhs = Vector::Zero();
  double squares = 0.0;  // sum of squared residuals
  double seen = 0.0;     // number of pixels that constrain the model: pixel or model is below the top of the range
};

/// The normal distribution and its density at t: the profile of a blurred edge, and the slope of the profile.
struct Edge {
  Floats below, slope;
};
// Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 26.2.17; the error is at most 7.5e-8.
Edge edge_at(Floats t) {
  const Floats far = least(all_of(5.0), t < 0.0F ? -t : t);
  // exp(x) is exp(x / 32) squared five times; exp(x / 32) needs a short series only.
  const Floats x = far * far * (-0.5F / 32.0F);
  Floats power = 1.0F + x * (1.0F + x * (1.0F / 2 + x * (1.0F / 6 + x * (1.0F / 24 + x * (1.0F / 120 + x / 720.0F)))));
  for (int i = 0; i < 5; ++i) power = power * power;
  const Floats slope = 0.39894228F * power, k = 1.0F / (1.0F + 0.2316419F * far);
  const Floats beyond =
      slope * k * (0.31938153F + k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return {t < 0.0F ? beyond : 1.0F - beyond, slope};
}

/// The normal equations linearised at `disc`, residuals in grey levels. The centre of `disc` is relative to the initial
/// centre.
Normals normals_at(const Rim& rim, const SoftDisc& disc, const DiscFitLevels& levels) {
  const Floats top = all_of(levels.top), background = all_of(levels.background), one = all_of(1.0), none{};
  const Floats height = all_of(disc.height), radius = all_of(disc.radius_px), per_edge = all_of(1.0 / disc.edge_px);
  const Floats middle_x = all_of(disc.x), middle_y = all_of(disc.y);
  Floats sums[kUnknowns * (kUnknowns + 1) / 2] = {}, rhs[kUnknowns] = {}, squares{}, seen{};
  for (std::size_t i = 0; i < rim.size; i += kLanes) {
    const Floats dx = loaded(&rim.x[i]) - middle_x, dy = loaded(&rim.y[i]) - middle_y, grey = loaded(&rim.grey[i]);
    const Floats distance = root(dx * dx + dy * dy + 1e-9F);
    const Floats t = (radius - distance) * per_edge;
    const auto [below, slope] = edge_at(t);
    const Floats model = background + height * below;
    const Mask is_pixel = grey >= none, cut_off = model >= top, tells = is_pixel & ~cut_off;
    const Floats residual = where(is_pixel, grey - least(model, top));
    squares += residual * residual;
    // If pixel and model are both saturated, the pixel constrains nothing. If only the model is, the model is too
    // bright.
    seen += where(tells | (is_pixel & cut_off & (grey < top)), one);
    const Floats light = where(tells, height * slope), steep = light * per_edge, toward = steep / distance;
    const Floats row[kUnknowns] = {toward * dx, toward * dy, steep, -light * t, where(tells, height * below)};
    for (int j = 0, n = 0; j < kUnknowns; ++j) {
      rhs[j] += row[j] * residual;
      for (int k = 0; k <= j; ++k, ++n) sums[n] += row[j] * row[k];
    }
  }
  Normals normals;
  normals.squares = sum_of(squares);
  normals.seen = sum_of(seen);
  for (int j = 0, n = 0; j < kUnknowns; ++j) {
    normals.rhs[j] = sum_of(rhs[j]);
    for (int k = 0; k <= j; ++k, ++n) normals.matrix(j, k) = normals.matrix(k, j) = sum_of(sums[n]);
  }
  return normals;
}

/// Adds the prior of edge and height to the normal equations, whose residuals have the given variance.
void add_prior(const SoftDisc& disc, const SoftDisc& start, double variance, Normals& normals) {
  const double edge_weight = variance / (kEdgeSigmaShare * kEdgeSigmaShare);
  const double height_weight = variance / (kHeightSigmaShare * kHeightSigmaShare);
  const double edge_off = (kPriorEdge_px - disc.edge_px) / disc.edge_px;
  const double height_off = (start.height - disc.height) / disc.height;
  normals.matrix(3, 3) += edge_weight;
  normals.matrix(4, 4) += height_weight;
  normals.rhs[3] += edge_weight * edge_off;
  normals.rhs[4] += height_weight * height_off;
  normals.squares += edge_weight * edge_off * edge_off + height_weight * height_off * height_off;
}

SoftDisc moved(const SoftDisc& disc, const Vector& step) {
  const auto bounded = [](double value) { return std::clamp(value, -0.7, 0.7); };
  SoftDisc next = disc;
  next.x += bounded(step[0]);
  next.y += bounded(step[1]);
  next.radius_px = std::max(0.3, disc.radius_px + bounded(step[2]));
  next.edge_px = std::clamp(disc.edge_px * (1.0 + bounded(step[3])), kLeastEdge_px, kMostEdge_px);
  next.height = disc.height * (1.0 + bounded(step[4]));
  return next;
}

}  // namespace

std::optional<FittedDisc> fit_disc(const Box& box, int width_px, const DiscFitLevels& levels, const SoftDisc& start) {
  Rim rim;
  gather_rim(box, width_px, levels, start, rim);
  if (rim.size < 2 * kUnknowns) return std::nullopt;
  const double range = levels.top - levels.background;
  const double variance = levels.noise * levels.noise + kModelError * kModelError * range * range;
  SoftDisc disc = start;
  disc.x = disc.y = 0.0;
  Normals normals = normals_at(rim, disc, levels);
  add_prior(disc, start, variance, normals);
  double damping = 1e-3;
  bool converged = false;
  for (int round = 0; round < kMaxRounds && !converged; ++round) {
    Matrix damped = normals.matrix;
    damped.diagonal() *= 1.0 + damping;
    const Vector step = damped.ldlt().solve(normals.rhs);
    if (!step.allFinite()) return std::nullopt;
    const SoftDisc next = moved(disc, step);
    Normals at_next = normals_at(rim, next, levels);
    add_prior(next, start, variance, at_next);
    converged = std::max(std::abs(step[0]), std::abs(step[1])) < kConverged_px &&
                at_next.squares > kConvergedShare * normals.squares && at_next.squares < 1.001 * normals.squares;
    if (at_next.squares > normals.squares) {
      damping = std::min(1e6, 10.0 * damping);
      continue;
    }
    damping *= 0.1;
    disc = next;
    normals = at_next;
  }
  const double left = normals.squares / std::max(1.0, normals.seen - kUnknowns);
  const double worst = levels.noise * levels.noise * 1.5 * 1.5 + kWorstModelError * kWorstModelError * range * range;
  if (!(left < worst) || std::hypot(disc.x, disc.y) > std::max(kMaxShift_px, kMaxRelativeShift * start.radius_px))
    return std::nullopt;
  const Matrix inverse = normals.matrix.ldlt().solve(Matrix::Identity());
  const double variance_px2 = 0.5 * (inverse(0, 0) + inverse(1, 1)) * std::max(left, levels.noise * levels.noise);
  if (!(variance_px2 > 0.0)) return std::nullopt;
  disc.x += start.x;
  disc.y += start.y;
  return FittedDisc{disc, std::sqrt(variance_px2)};
}

}  // namespace mocap::detect
