#include "calibrate/lens_report.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace mocap::calibrate {
namespace {

using calibration::LensFit;
using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180.0 / std::numbers::pi;
// A larger ratio of the cross-validation residual to the fit residual is a sign of overfitting. Chosen by hand.
constexpr double kOverfit = 1.4;
constexpr double kMaxCornerSigma_px = 1.0;

constexpr std::array<const char*, 9> kPinholeNames{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array<const char*, 9> kFisheyeNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", ""};

const auto& names_of(const Lens& lens) { return lens.kind == LensKind::Fisheye ? kFisheyeNames : kPinholeNames; }

calibration::IntrinsicVector values_of(const Lens& lens) {
  calibration::IntrinsicVector values;
  values << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion;
  return values;
}

std::string fit_text(const LensFit& fit) {
  const auto values = values_of(fit.lens);
  std::string text;
  for (int i = 0; i < calibration::kIntrinsicCount; ++i) {
    if (!fit.estimated[i]) continue;
    text += fmt::format("  {:<3} {:>12.{}f} +- {:.{}f}{}\n", names_of(fit.lens)[static_cast<std::size_t>(i)], values[i],
                        i < 4 ? 3 : 6, fit.sigma[i], i < 4 ? 3 : 6, i < 4 ? " px" : "");
  }
  for (const std::string& left : fit.not_estimated) text += fmt::format("  not estimated, stays 0: {}\n", left);
  text +=
      fmt::format("  {:.3f} px rms, {:.3f} px on held-out boards; {} boards", fit.rms_px, fit.heldout_px, fit.views);
  text += fit.left_out.empty() ? "\n" : fmt::format(", {} inconsistent boards left out\n", fit.left_out.size());
  text += fmt::format("  uncertainty of rays: {:.3f} px where boards were seen, {:.3f} px in the image corners\n",
                      fit.rim_sigma_px, fit.corner_sigma_px);
  if (fit.heldout_px > kOverfit * fit.rms_px) {
    text += "  hint: held-out boards have a larger residual: show more boards, at more positions and angles\n";
  }
  if (!(fit.corner_sigma_px < kMaxCornerSigma_px)) {
    text += fmt::format(
        "  hint: the lens is uncertain beyond {:.0f} % of the distance to the corners; show the board there\n",
        100.0 * fit.coverage.reach);
  }
  return text;
}

Json json_of(const LensOutcome& outcome) {
  Json json{{"images", outcome.images},
            {"found", outcome.found},
            {"size", {outcome.width_px, outcome.height_px}},
            {"coverage", outcome.coverage.share},
            {"reach", outcome.coverage.reach}};
  if (!outcome.fit) {
    json["refused"] = outcome.fit.error().message;
    return json;
  }
  const LensFit& fit = *outcome.fit;
  json["boards"] = fit.views;
  json["left_out"] = fit.left_out.size();
  json["rms_px"] = fit.rms_px;
  json["heldout_px"] = fit.heldout_px;
  json["tilt_deg"] = kDegrees * fit.coverage.tilt_rad;
  json["rim_sigma_px"] = std::isfinite(fit.rim_sigma_px) ? Json(fit.rim_sigma_px) : Json(nullptr);
  json["corner_sigma_px"] = std::isfinite(fit.corner_sigma_px) ? Json(fit.corner_sigma_px) : Json(nullptr);
  json["fisheye"] = fit.lens.kind == LensKind::Fisheye;
  const auto values = values_of(fit.lens);
  for (int i = 0; i < calibration::kIntrinsicCount; ++i) {
    const std::string name = names_of(fit.lens)[static_cast<std::size_t>(i)];
    if (name.empty()) continue;
    json["lens"][name] = values[i];
    if (fit.estimated[i]) json["sigma"][name] = fit.sigma[i];
  }
  json["not_claimed"] = fit.not_estimated;
  return json;
}

}  // namespace

std::string lens_text(const LensOutcome& outcome) {
  std::string text = fmt::format("camera {}: board found in {} of {} images, {}x{}\n", outcome.name, outcome.found,
                                 outcome.images, outcome.width_px, outcome.height_px);
  text +=
      fmt::format("  {:.0f} % of the image covered, to {:.0f} % of the distance to the corners{}\n",
                  100.0 * outcome.coverage.share, 100.0 * outcome.coverage.reach,
                  outcome.fit ? fmt::format(", tilts up to {:.0f} degrees", kDegrees * outcome.fit->coverage.tilt_rad)
                              : std::string());
  text += coverage_map(outcome.coverage, "    ");
  return text + (outcome.fit ? fit_text(*outcome.fit) : fmt::format("  refused: {}\n", outcome.fit.error().message));
}

std::string lens_json(const std::vector<LensOutcome>& outcomes) {
  Json cameras = Json::object();
  for (const LensOutcome& outcome : outcomes) cameras[outcome.name] = json_of(outcome);
  return Json{{"cameras", cameras}}.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mocap::calibrate
