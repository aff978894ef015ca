#include "calibrate/report_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "settings/replace_file.h"

namespace mocap::calibrate {
namespace {

using calibration::CameraChange;
using calibration::CameraJudgement;
using calibration::RigChange;
using calibration::RigJudgement;
using Json = nlohmann::ordered_json;

constexpr double kMm = 1e3;
constexpr double kDegrees = 180.0 / std::numbers::pi;

Json or_null(const std::optional<double>& figure, double unit = 1.0) {
  return figure && std::isfinite(*figure) ? Json(unit * *figure) : Json(nullptr);
}

std::string px(const std::optional<double>& figure) { return figure ? fmt::format("{:.3f}", *figure) : "-"; }

// Names are as long as their owners like.
std::size_t widest_name(const auto& cameras) {
  std::size_t width = 6;
  for (const auto& camera : cameras) width = std::max(width, camera.name.size());
  return width;
}

Json json_of(const CameraJudgement& camera) {
  return {{"rms_px", camera.rms_px},
          {"heldout_px", or_null(camera.heldout_px)},
          {"points", camera.points},
          {"heldout_points", camera.heldout_points},
          {"coverage", camera.coverage},
          {"pattern_px", camera.pattern_px},
          {"position_sigma_mm", kMm * camera.position_doubt_m},
          {"rotation_sigma_deg", kDegrees * camera.rotation_doubt_rad}};
}

Json json_of(const RigChange& change) {
  Json cameras = Json::object();
  for (const CameraChange& camera : change.cameras) {
    cameras[camera.name] = {{"position_error_mm", kMm * camera.position_m},
                            {"rotation_error_deg", kDegrees * camera.rotation_rad},
                            {"raw_position_error_mm", kMm * camera.raw_position_m},
                            {"raw_rotation_error_deg", kDegrees * camera.raw_rotation_rad},
                            {"focal_error", camera.focal_share},
                            {"image_px", camera.image_px}};
  }
  return {{"position_error_mm", kMm * change.position_m},
          {"rotation_error_deg", kDegrees * change.rotation_rad},
          {"scale_error", change.scale - 1.0},
          {"frame_moved_mm", kMm * change.frame_moved_m},
          {"frame_turned_deg", kDegrees * change.frame_turned_rad},
          {"cameras", cameras},
          {"only_old", change.only_old},
          {"only_new", change.only_new}};
}

Json json_of(const calibration::VolumeUncertainty& volume) {
  return {{"from_m", {volume.from_m.x(), volume.from_m.y(), volume.from_m.z()}},
          {"to_m", {volume.to_m.x(), volume.to_m.y(), volume.to_m.z()}},
          {"median_mm", kMm * volume.median_m},
          {"p90_mm", kMm * volume.p90_m},
          {"unseen_share", volume.unseen_share}};
}

std::string cameras_text(const RigJudgement& judgement) {
  const std::size_t width = widest_name(judgement.cameras);
  std::string text = fmt::format("{:<{}}  {:>7} {:>8} {:>7} {:>8} {:>10} {:>11}\n", "camera", width, "rms px",
                                 "held out", "points", "coverage", "sigma mm", "sigma deg");
  for (const CameraJudgement& camera : judgement.cameras) {
    text += fmt::format("{:<{}}  {:>7.3f} {:>8} {:>7} {:>6.0f} % {:>10.2f} {:>11.4f}\n", camera.name, width,
                        camera.rms_px, px(camera.heldout_px), camera.points, 100.0 * camera.coverage,
                        kMm * camera.position_doubt_m, kDegrees * camera.rotation_doubt_rad);
  }
  return text + fmt::format("{:<{}}  {:>7.3f} {:>8}\n", "all", width, judgement.rms_px, px(judgement.heldout_px));
}

}  // namespace

std::string change_text(const RigChange& change) {
  const std::size_t width = widest_name(change.cameras);
  std::string text = fmt::format("{:<{}}  {:>9} {:>9} {:>8} | {:>9} {:>9} {:>9}\n", "camera", width, "moved mm",
                                 "turned deg", "image px", "raw mm", "raw deg", "focal %");
  for (const CameraChange& camera : change.cameras) {
    text += fmt::format("{:<{}}  {:>9.3f} {:>10.4f} {:>8.3f} | {:>9.3f} {:>9.4f} {:>+9.4f}\n", camera.name, width,
                        kMm * camera.position_m, kDegrees * camera.rotation_rad, camera.image_px,
                        kMm * camera.raw_position_m, kDegrees * camera.raw_rotation_rad, 100.0 * camera.focal_share);
  }
  text += fmt::format("{:<{}}  {:>9.3f} {:>10.4f}   (rms, after the frames are laid on each other)\n", "all", width,
                      kMm * change.position_m, kDegrees * change.rotation_rad);
  text += fmt::format("frame: origin moved {:.3f} mm, turned {:.4f} deg; scale {:+.4f} %\n", kMm * change.frame_moved_m,
                      kDegrees * change.frame_turned_rad, 100.0 * (change.scale - 1.0));
  for (const std::string& name : change.only_old) text += fmt::format("camera '{}' is in the old rig only\n", name);
  for (const std::string& name : change.only_new) text += fmt::format("camera '{}' is in the new rig only\n", name);
  return text;
}

std::string change_json(const RigChange& change) { return json_of(change).dump(2) + "\n"; }

std::string report_text(const RigReport& report) {
  const RigJudgement& judgement = report.judgement;
  std::string text = fmt::format("{}: {}\n\n", report.title, calibration::name_of(judgement.grade));
  text += cameras_text(judgement) + "\n";
  if (judgement.wand) {
    const auto& wand = *judgement.wand;
    text += fmt::format("wand    {:.3f} mm +- {:.3f}, {:.2f} to {:.2f}; told {:.3f}; {} samples\n", kMm * wand.mean_m,
                        kMm * wand.std_m, kMm * wand.min_m, kMm * wand.max_m, kMm * wand.told_m, wand.samples);
  }
  if (judgement.scale_error) text += fmt::format("scale   {:+.4f} %\n", 100.0 * *judgement.scale_error);
  if (judgement.floor) {
    text += fmt::format("floor   {:.2f} mm rms; the lowest camera is {:.2f} m over it\n", kMm * judgement.floor->rms_m,
                        judgement.floor->lowest_camera_m);
  }
  if (judgement.volume) {
    const auto& volume = *judgement.volume;
    const Eigen::Vector3d size = volume.to_m - volume.from_m;
    text +=
        fmt::format("volume  {:.1f} x {:.1f} x {:.1f} m: markers known to {:.2f} mm (half of it), {:.2f} mm (90 %)\n",
                    size.x(), size.y(), size.z(), kMm * volume.median_m, kMm * volume.p90_m);
  }
  if (report.to_truth) text += "\nagainst the truth\n" + change_text(*report.to_truth);
  if (report.since_old) text += "\nagainst the rig before\n" + change_text(*report.since_old);
  if (!judgement.issues.empty()) text += "\nwhat would make it better\n";
  for (const auto& issue : judgement.issues) {
    text += fmt::format("  {:<4} {}\n", calibration::name_of(issue.grade), issue.text);
  }
  return text;
}

std::string report_json(const RigReport& report) {
  const RigJudgement& judgement = report.judgement;
  Json json;
  json["title"] = report.title;
  json["grade"] = calibration::name_of(judgement.grade);
  json["rms_px"] = judgement.rms_px;
  json["heldout_px"] = or_null(judgement.heldout_px);
  Json cameras = Json::object();
  for (const CameraJudgement& camera : judgement.cameras) cameras[camera.name] = json_of(camera);
  json["cameras"] = cameras;
  json["wand"] = nullptr;
  if (judgement.wand) {
    const auto& wand = *judgement.wand;
    json["wand"] = {{"told_mm", kMm * wand.told_m}, {"mean_mm", kMm * wand.mean_m}, {"std_mm", kMm * wand.std_m},
                    {"min_mm", kMm * wand.min_m},   {"max_mm", kMm * wand.max_m},   {"samples", wand.samples}};
  }
  json["scale_error"] = or_null(judgement.scale_error);
  json["floor"] = nullptr;
  if (judgement.floor) {
    json["floor"] = {{"rms_mm", kMm * judgement.floor->rms_m},
                     {"lowest_camera_mm", kMm * judgement.floor->lowest_camera_m}};
  }
  json["volume"] = judgement.volume ? json_of(*judgement.volume) : Json(nullptr);
  if (report.to_truth) {
    json["position_error_mm"] = kMm * report.to_truth->position_m;
    json["rotation_error_deg"] = kDegrees * report.to_truth->rotation_rad;
    json["truth"] = json_of(*report.to_truth);
  }
  if (report.since_old) json["old"] = json_of(*report.since_old);
  json["issues"] = Json::array();
  for (const auto& issue : judgement.issues) {
    json["issues"].push_back({{"grade", calibration::name_of(issue.grade)}, {"text", issue.text}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Status write_report(const std::filesystem::path& path, const RigReport& report) {
  const auto ending = path.extension();
  const std::string text = ending == ".svg"    ? report_svg(report)
                           : ending == ".json" ? report_json(report)
                                               : report_text(report);
  return settings::replace_file(path, text);
}

}  // namespace mocap::calibrate
