#include "calibrate/report_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/replace_file.h"

namespace mocap::calibrate {
namespace {

using calibration::CameraAssessment;
using calibration::CameraChange;
using calibration::RigAssessment;
using calibration::RigChange;
using Json = nlohmann::ordered_json;

constexpr double kMmPerM = 1e3;
constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;

Json or_null(const std::optional<double>& figure, double unit = 1.0) {
  return figure && std::isfinite(*figure) ? Json(unit * *figure) : Json(nullptr);
}

std::string figure_or_dash(const std::optional<double>& figure, int digits, double unit = 1.0) {
  return figure ? fmt::format("{:.{}f}", unit * *figure, digits) : "-";
}

std::size_t widest_name(const auto& cameras) {
  std::size_t width = 6;
  for (const auto& camera : cameras) width = std::max(width, camera.name.size());
  return width;
}

Json json_of(const CameraAssessment& camera) {
  return {{"rms_px", camera.rms_px},
          {"heldout_px", or_null(camera.heldout_px)},
          {"points", camera.points},
          {"heldout_points", camera.heldout_points},
          {"coverage", camera.coverage},
          {"pattern_px", camera.systematic_px},
          {"position_sigma_mm", or_null(camera.position_sigma_m, kMmPerM)},
          {"rotation_sigma_deg", or_null(camera.rotation_sigma_rad, kDegreesPerRad)}};
}

Json json_of(const RigChange& change) {
  Json cameras = Json::object();
  for (const CameraChange& camera : change.cameras) {
    cameras[camera.name] = {{"position_error_mm", kMmPerM * camera.position_m},
                            {"rotation_error_deg", kDegreesPerRad * camera.rotation_rad},
                            {"raw_position_error_mm", kMmPerM * camera.raw_position_m},
                            {"raw_rotation_error_deg", kDegreesPerRad * camera.raw_rotation_rad},
                            {"focal_error", camera.focal_change},
                            {"image_px", or_null(camera.image_px)}};
  }
  return {{"position_error_mm", kMmPerM * change.position_m},
          {"rotation_error_deg", kDegreesPerRad * change.rotation_rad},
          {"scale_error", change.scale - 1.0},
          {"frame_moved_mm", kMmPerM * change.world_moved_m},
          {"frame_turned_deg", kDegreesPerRad * change.world_rotated_rad},
          {"cameras", cameras},
          {"only_old", change.only_old},
          {"only_new", change.only_new}};
}

Json json_of(const calibration::VolumeUncertainty& volume) {
  return {{"from_m", {volume.from_m.x(), volume.from_m.y(), volume.from_m.z()}},
          {"to_m", {volume.to_m.x(), volume.to_m.y(), volume.to_m.z()}},
          {"median_mm", or_null(volume.median_m, kMmPerM)},
          {"p90_mm", or_null(volume.p90_m, kMmPerM)},
          {"unseen_share", volume.unseen_fraction}};
}

std::string cameras_text(const RigAssessment& assessment) {
  const std::size_t width = widest_name(assessment.cameras);
  std::string text = fmt::format("{:<{}}  {:>7} {:>8} {:>7} {:>8} {:>10} {:>11}\n", "camera", width, "rms px",
                                 "held out", "points", "coverage", "sigma mm", "sigma deg");
  for (const CameraAssessment& camera : assessment.cameras) {
    text += fmt::format("{:<{}}  {:>7.3f} {:>8} {:>7} {:>6.0f} % {:>10} {:>11}\n", camera.name, width, camera.rms_px,
                        figure_or_dash(camera.heldout_px, 3), camera.points, 100.0 * camera.coverage,
                        figure_or_dash(camera.position_sigma_m, 2, kMmPerM),
                        figure_or_dash(camera.rotation_sigma_rad, 4, kDegreesPerRad));
  }
  return text + fmt::format("{:<{}}  {:>7.3f} {:>8}\n", "all", width, assessment.rms_px,
                            figure_or_dash(assessment.heldout_px, 3));
}

}  // namespace

std::string change_text(const RigChange& change) {
  const std::size_t width = widest_name(change.cameras);
  std::string text = fmt::format("{:<{}}  {:>9} {:>10} {:>8} | {:>9} {:>9} {:>9}\n", "camera", width, "moved mm",
                                 "angle deg", "image px", "raw mm", "raw deg", "focal %");
  for (const CameraChange& camera : change.cameras) {
    text += fmt::format("{:<{}}  {:>9.3f} {:>10.4f} {:>8} | {:>9.3f} {:>9.4f} {:>+9.4f}\n", camera.name, width,
                        kMmPerM * camera.position_m, kDegreesPerRad * camera.rotation_rad,
                        figure_or_dash(camera.image_px, 3), kMmPerM * camera.raw_position_m,
                        kDegreesPerRad * camera.raw_rotation_rad, 100.0 * camera.focal_change);
  }
  text += fmt::format("{:<{}}  {:>9.3f} {:>10.4f}   (rms, after the alignment of the frames)\n", "all", width,
                      kMmPerM * change.position_m, kDegreesPerRad * change.rotation_rad);
  text += fmt::format("world: origin moved {:.3f} mm, rotated {:.4f} deg; scale {:+.4f} %\n",
                      kMmPerM * change.world_moved_m, kDegreesPerRad * change.world_rotated_rad,
                      100.0 * (change.scale - 1.0));
  for (const std::string& name : change.only_old) text += fmt::format("camera '{}' is in the old rig only\n", name);
  for (const std::string& name : change.only_new) text += fmt::format("camera '{}' is in the new rig only\n", name);
  return text;
}

std::string change_json(const RigChange& change) { return json_of(change).dump(2) + "\n"; }

std::string report_text(const RigReport& report) {
  const RigAssessment& assessment = report.assessment;
  std::string text = fmt::format("{}: {}\n\n", report.title, calibration::name_of(assessment.grade));
  text += cameras_text(assessment) + "\n";
  if (assessment.wand) {
    const auto& wand = *assessment.wand;
    text += fmt::format("wand    {:.3f} mm +- {:.3f}, {:.2f} to {:.2f}; nominal {:.3f}; {} samples\n",
                        kMmPerM * wand.mean_m, kMmPerM * wand.std_m, kMmPerM * wand.min_m, kMmPerM * wand.max_m,
                        kMmPerM * wand.nominal_m, wand.samples);
  }
  if (assessment.wand) text += "scale   from the wand's length, not checked\n";
  if (assessment.lowest_camera_m) {
    text += fmt::format("floor   where it was; the lowest camera is {:.2f} m above it\n", *assessment.lowest_camera_m);
  }
  if (assessment.volume) {
    const auto& volume = *assessment.volume;
    const Eigen::Vector3d size = volume.to_m - volume.from_m;
    text += fmt::format("volume  {:.1f} x {:.1f} x {:.1f} m: uncertainty of markers {} mm (median), {} mm (90 %)\n",
                        size.x(), size.y(), size.z(), figure_or_dash(volume.median_m, 2, kMmPerM),
                        figure_or_dash(volume.p90_m, 2, kMmPerM));
  }
  if (report.to_truth) text += "\nagainst the truth\n" + change_text(*report.to_truth);
  if (report.since_previous) text += "\nagainst the previous rig\n" + change_text(*report.since_previous);
  if (!assessment.issues.empty()) text += "\nissues\n";
  for (const auto& issue : assessment.issues) {
    text += fmt::format("  {:<4} {}\n", calibration::name_of(issue.grade), issue.text);
  }
  return text;
}

std::string report_json(const RigReport& report) {
  const RigAssessment& assessment = report.assessment;
  Json json;
  json["title"] = report.title;
  json["grade"] = calibration::name_of(assessment.grade);
  json["rms_px"] = assessment.rms_px;
  json["heldout_px"] = or_null(assessment.heldout_px);
  Json cameras = Json::object();
  for (const CameraAssessment& camera : assessment.cameras) cameras[camera.name] = json_of(camera);
  json["cameras"] = cameras;
  json["wand"] = nullptr;
  if (assessment.wand) {
    const auto& wand = *assessment.wand;
    json["wand"] = {{"told_mm", kMmPerM * wand.nominal_m},
                    {"mean_mm", kMmPerM * wand.mean_m},
                    {"std_mm", kMmPerM * wand.std_m},
                    {"min_mm", kMmPerM * wand.min_m},
                    {"max_mm", kMmPerM * wand.max_m},
                    {"samples", wand.samples},
                    {"mismatch", or_null(assessment.wand_mismatch)}};
  }
  json["floor"] = nullptr;
  if (assessment.lowest_camera_m) json["floor"] = {{"lowest_camera_mm", kMmPerM * *assessment.lowest_camera_m}};
  json["volume"] = assessment.volume ? json_of(*assessment.volume) : Json(nullptr);
  if (report.to_truth) {
    json["position_error_mm"] = kMmPerM * report.to_truth->position_m;
    json["rotation_error_deg"] = kDegreesPerRad * report.to_truth->rotation_rad;
    json["truth"] = json_of(*report.to_truth);
  }
  if (report.since_previous) json["old"] = json_of(*report.since_previous);
  json["issues"] = Json::array();
  for (const auto& issue : assessment.issues) {
    json["issues"].push_back({{"grade", calibration::name_of(issue.grade)}, {"text", issue.text}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Status write_report(const std::filesystem::path& path, const RigReport& report) {
  const auto ending = path.extension();
  const std::string text = ending == ".svg"    ? report_svg(report)
                           : ending == ".json" ? report_json(report)
                                               : report_text(report);
  return replace_file(path, text);
}

}  // namespace mocap::calibrate
