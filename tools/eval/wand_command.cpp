#include <fmt/core.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "calibration/wand/solve_wand.h"
#include "eval/command.h"
#include "geometry/rigid_fit.h"
#include "lib/cli/app.h"
#include "lib/simworld/wand_world.h"

namespace mocap::eval {
namespace {

constexpr const char* kWandExamples =
    "A wand is moved in front of simulated cameras. The calibration is aligned with the true rig (rotation and\n"
    "translation, no scale) and compared with it. rms_px is per axis. predicted_over_true: the standard\n"
    "deviations that the solution predicts for all camera poses, over the true errors (root of degrees of\n"
    "freedom over chi-square). A consistent solution has 1 on average; one take deviates by the standard\n"
    "deviation predicted_chance. With --seeds this figure is computed over several takes, and the other figures\n"
    "are the worst of all takes.\n"
    "\n"
    "examples:\n"
    "  mocap-eval wand --cameras 8 --noise-px 0.1 --seconds 60\n"
    "  mocap-eval wand --no-lens --seed 3 --json\n"
    "  mocap-eval wand --cameras 6 --seconds 10 --rate 20 --seeds 20\n";

struct WandOptions {
  simworld::WandWorldSettings world;
  std::vector<double> wand_mm{0.0, 160.0, 500.0};
  std::uint64_t seed = 1;
  int seeds = 1;
  bool no_lens = false;
  int threads = 2;
  bool json = false;
};

struct WandScore {
  double position_error_mm = 0.0;  ///< root mean square over the cameras
  double position_worst_mm = 0.0;
  double rotation_error_deg = 0.0;
  double rotation_worst_deg = 0.0;
  double scale_error = 0.0;
  double focal_error = 0.0;  ///< largest relative error
  double predicted_over_true = 0.0;
  double predicted_chance = 0.0;  ///< expected standard deviation of predicted_over_true for a consistent solution
  double rms_px = 0.0;
  std::size_t samples = 0;
  double wand_mean_mm = 0.0, wand_std_mm = 0.0, wand_min_mm = 0.0, wand_max_mm = 0.0;
  double seconds = 0.0;
};

double spread(const Rig& rig) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const CameraModel& camera : rig) middle += camera.centre().v / static_cast<double>(rig.size());
  double sum = 0.0;
  for (const CameraModel& camera : rig) sum += (camera.centre().v - middle).squaredNorm();
  return std::sqrt(sum);
}

// The covariance is singular in the six directions of a rigid motion of the whole rig, which are left out.
double predicted_over_true(const Eigen::VectorXd& errors, const Eigen::MatrixXd& covariance) {
  if (covariance.rows() != errors.size()) return 0.0;
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();  // m and rad
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * covariance * scale.asDiagonal());
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * (scale.asDiagonal() * errors);
  double chi2 = 0.0;
  for (Eigen::Index i = 6; i < along.size(); ++i) chi2 += along[i] * along[i] / eigen.eigenvalues()[i];
  return std::sqrt(static_cast<double>(along.size() - 6) / chi2);
}

WandScore compare(const calibration::WandSolution& solution, const Rig& truth) {
  const Rig& rig = solution.bundle.rig;
  std::vector<geometry::PointPair> centres;
  for (std::size_t c = 0; c < rig.size(); ++c) centres.push_back({rig[c].centre().v, truth[c].centre().v});
  WandScore score;
  const auto aligned = geometry::fit_rigid(centres);
  if (!aligned) return score;
  const Eigen::Matrix3d true_from_rig = aligned->to_from.rotation.toRotationMatrix();
  double places = 0.0;
  double squared_angles = 0.0;
  Eigen::VectorXd errors(6 * static_cast<Eigen::Index>(rig.size()));  // in the rig's axes
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const double place = (aligned->to_from * centres[c].from - centres[c].to).norm();
    const Eigen::Matrix3d off = truth[c].camera_from_world.rotation *
                                (rig[c].camera_from_world.rotation * true_from_rig.transpose()).transpose();
    const Eigen::AngleAxisd angle_axis(off);
    const double angle = std::abs(angle_axis.angle());
    places += place * place;
    squared_angles += angle * angle;
    const auto first = 6 * static_cast<Eigen::Index>(c);
    errors.segment<3>(first) = true_from_rig.transpose() * (centres[c].to - aligned->to_from * centres[c].from);
    errors.segment<3>(first + 3) =
        -(rig[c].camera_from_world.rotation.transpose() * (angle_axis.angle() * angle_axis.axis()));
    score.position_worst_mm = std::max(score.position_worst_mm, 1e3 * place);
    score.rotation_worst_deg = std::max(score.rotation_worst_deg, angle * 180.0 / std::numbers::pi);
    const Lens& lens = rig[c].lens;
    const Lens& true_lens = truth[c].lens;
    score.focal_error = std::max({score.focal_error, std::abs(lens.fx_px / true_lens.fx_px - 1.0),
                                  std::abs(lens.fy_px / true_lens.fy_px - 1.0)});
  }
  const auto n = static_cast<double>(rig.size());
  score.position_error_mm = 1e3 * std::sqrt(places / n);
  score.rotation_error_deg = std::sqrt(squared_angles / n) * 180.0 / std::numbers::pi;
  score.scale_error = spread(rig) / spread(truth) - 1.0;
  score.predicted_over_true = predicted_over_true(errors, solution.covariance);
  score.predicted_chance = 1.0 / std::sqrt(2.0 * static_cast<double>(errors.size() - 6));
  score.rms_px = solution.rms_px;
  score.samples = solution.samples;
  score.wand_mean_mm = 1e3 * solution.length_mean_m;
  score.wand_std_mm = 1e3 * solution.length_std_m;
  score.wand_min_mm = 1e3 * solution.length_min_m;
  score.wand_max_mm = 1e3 * solution.length_max_m;
  return score;
}

// The worst value of each figure over several takes; predicted_over_true is computed over all takes.
WandScore worst_of(const std::vector<WandScore>& all) {
  WandScore worst = all.front();
  double chi2_mean = 0.0;  // mean chi squared over its degrees of freedom
  for (const WandScore& one : all) {
    worst.position_error_mm = std::max(worst.position_error_mm, one.position_error_mm);
    worst.position_worst_mm = std::max(worst.position_worst_mm, one.position_worst_mm);
    worst.rotation_error_deg = std::max(worst.rotation_error_deg, one.rotation_error_deg);
    worst.rotation_worst_deg = std::max(worst.rotation_worst_deg, one.rotation_worst_deg);
    if (std::abs(one.scale_error) > std::abs(worst.scale_error)) worst.scale_error = one.scale_error;
    worst.focal_error = std::max(worst.focal_error, one.focal_error);
    worst.rms_px = std::max(worst.rms_px, one.rms_px);
    worst.samples = std::min(worst.samples, one.samples);
    worst.wand_std_mm = std::max(worst.wand_std_mm, one.wand_std_mm);
    worst.wand_min_mm = std::min(worst.wand_min_mm, one.wand_min_mm);
    worst.wand_max_mm = std::max(worst.wand_max_mm, one.wand_max_mm);
    worst.seconds = std::max(worst.seconds, one.seconds);
    chi2_mean += 1.0 / (one.predicted_over_true * one.predicted_over_true) / static_cast<double>(all.size());
  }
  worst.predicted_over_true = 1.0 / std::sqrt(chi2_mean);
  worst.predicted_chance /= std::sqrt(static_cast<double>(all.size()));
  return worst;
}

void print(const WandOptions& options, const WandScore& score) {
  if (options.json) {
    fmt::print(
        "{{\"cameras\": {}, \"noise_px\": {}, \"no_lens\": {}, \"seed\": {}, \"seeds\": {}, \"samples\": {}, "
        "\"rms_px\": "
        "{:.5f}, \"position_error_mm\": {:.4f}, \"position_worst_mm\": {:.4f}, \"rotation_error_deg\": {:.5f}, "
        "\"rotation_worst_deg\": {:.5f}, \"scale_error\": {:.6f}, \"focal_error\": {:.6f}, "
        "\"predicted_over_true\": {:.3f}, \"predicted_chance\": {:.3f}, \"wand\": {{\"mean_mm\": {:.4f}, \"std_mm\": "
        "{:.4f}, \"min_mm\": {:.3f}, \"max_mm\": {:.3f}}}, \"seconds\": {:.2f}}}\n",
        options.world.cameras, options.world.noise_px, options.no_lens, options.seed, options.seeds, score.samples,
        score.rms_px, score.position_error_mm, score.position_worst_mm, score.rotation_error_deg,
        score.rotation_worst_deg, score.scale_error, score.focal_error, score.predicted_over_true,
        score.predicted_chance, score.wand_mean_mm, score.wand_std_mm, score.wand_min_mm, score.wand_max_mm,
        score.seconds);
    return;
  }
  fmt::print("{} cameras, {} samples, {:.1f} s{}\n", options.world.cameras, score.samples, score.seconds,
             options.seeds > 1 ? fmt::format("; worst of {} takes", options.seeds) : "");
  fmt::print("  reprojection        {:.4f} px rms per axis (noise {})\n", score.rms_px, options.world.noise_px);
  fmt::print(
      "  camera positions    {:.3f} mm rms, {:.3f} mm at worst; predicted over true {:.2f} +- {:.2f} by chance\n",
      score.position_error_mm, score.position_worst_mm, score.predicted_over_true, score.predicted_chance);
  fmt::print("  camera rotations    {:.4f} degrees rms, {:.4f} at worst\n", score.rotation_error_deg,
             score.rotation_worst_deg);
  fmt::print("  scale               {:+.4f} %\n", 100.0 * score.scale_error);
  fmt::print("  focal length        {:.4f} % at worst\n", 100.0 * score.focal_error);
  fmt::print("  wand                {:.3f} mm +- {:.3f}, {:.2f} to {:.2f}\n", score.wand_mean_mm, score.wand_std_mm,
             score.wand_min_mm, score.wand_max_mm);
}

Result<WandScore, std::string> run_wand_seed(const WandOptions& options, const calibration::Wand& wand,
                                             std::uint64_t seed) {
  simworld::WandWorld world(options.world, wand, seed);
  const calibration::Take take = world.take();
  Rig start = options.no_lens ? world.rough_lenses(0.2) : world.truth();
  calibration::WandSettings settings;
  settings.lens_known = !options.no_lens;
  settings.threads = options.threads;
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const auto begun = std::chrono::steady_clock::now();
  const auto solution = calibration::solve_wand(take, start, wand, settings, [&](const char* doing, double share) {
    if (shows_progress) fmt::print(stderr, "\r\x1b[2K{} {:.0f} %", doing, 100.0 * share);
    return true;
  });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  if (shows_progress) fmt::print(stderr, "\r\x1b[2K");
  if (!solution) return fmt::format("seed {}: {}", seed, solution.error().message);
  WandScore score = compare(*solution, world.truth());
  score.seconds = seconds;
  return score;
}

int evaluate_wand(const WandOptions& options) {
  calibration::Wand wand;
  for (const double mark : options.wand_mm) wand.marks_m.push_back(1e-3 * mark);
  std::vector<WandScore> scores;
  for (int i = 0; i < options.seeds; ++i) {
    const auto score = run_wand_seed(options, wand, options.seed + static_cast<std::uint64_t>(i));
    if (!score) {
      fmt::print(stderr, "mocap-eval: {}\n", score.error());
      return kExitData;
    }
    scores.push_back(*score);
  }
  print(options, worst_of(scores));
  return 0;
}

}  // namespace

int run_wand(int argc, const char* const* argv) {
  WandOptions options;
  cli::App app("Scores a calibration from a simulated wand.", "mocap-eval wand");
  simworld::WandWorldSettings& world = options.world;
  app.add_option("--cameras", world.cameras)->check(cli::Range(2, 64))->capture_default_str();
  app.add_option("--noise-px", world.noise_px, "standard deviation of a blob centroid, each axis")
      ->check(cli::Range(0.001, 5.0))
      ->capture_default_str();
  app.add_option("--seconds", world.seconds, "duration of the take, s")
      ->check(cli::Range(0.1, 3600.0))
      ->capture_default_str();
  app.add_option("--rate", world.rate_hz, "images per second")->check(cli::Range(1.0, 1000.0))->capture_default_str();
  app.add_option("--false", world.false_blobs, "number of false blobs for each true blob")
      ->check(cli::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--wand", options.wand_mm, "distances of its markers from the first marker, mm: 0,160,500")
      ->delimiter(',')
      ->expected(2, 3)
      ->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--seeds", options.seeds,
                 "number of takes, each with its own rig and noise: --seed and the following seeds")
      ->check(cli::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--threads", options.threads)->check(cli::Range(1, 64))->capture_default_str();
  app.add_flag("--no-lens", options.no_lens, "start without lenses, with focal lengths that are wrong by up to 20 %");
  app.add_flag("--fisheye", world.fisheye, "fisheye lenses, 126 degrees wide");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(kWandExamples);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return evaluate_wand(options);
}

}  // namespace mocap::eval
