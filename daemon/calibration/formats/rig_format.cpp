#include "calibration/formats/rig_format.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "base/expects.h"
#include "base/literal_text.h"
#include "calibration/formats/format_reader.h"
#include "geometry/plausible_rig.h"
#include "model/image_bounds.h"

namespace mocap::calibration {
namespace {

struct FormatName {
  RigFormat format;
  const char* name;
};
constexpr std::array<FormatName, 4> kNames{{{RigFormat::OpenCv, "opencv"},
                                            {RigFormat::Kalibr, "kalibr"},
                                            {RigFormat::Pose2Sim, "pose2sim"},
                                            {RigFormat::Qca, "qca"}}};

constexpr double kMaxSize_px = kMaxImageSide_px;
// Largest deviation of R R^T from the identity: other programs write 6 to 17 digits.
constexpr double kRotationTolerance = 1e-4;

bool contains(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

}  // namespace

std::optional<RigFormat> format_named(std::string_view name) {
  for (const FormatName& each : kNames) {
    if (name == each.name) return each.format;
  }
  return std::nullopt;
}

const char* name_of(RigFormat format) {
  for (const FormatName& each : kNames) {
    if (format == each.format) return each.name;
  }
  return "";
}

std::optional<RigFormat> guess_format(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && text[first] == '<') {
    return contains(text, "<calibration") ? std::optional(RigFormat::Qca) : std::nullopt;
  }
  if (contains(text, "camera_model:") && contains(text, "intrinsics:")) return RigFormat::Kalibr;
  if (contains(text, "camera_matrix") &&
      (contains(text, "%YAML") || contains(text, "camera_matrix:") || contains(text, "!!opencv"))) {
    return RigFormat::OpenCv;
  }
  if (contains(text, "[") && contains(text, "matrix") && contains(text, "translation") && contains(text, "="))
    return RigFormat::Pose2Sim;
  return std::nullopt;
}

void FaultCollector::add(const TextPlace& at, std::string message) {
  FormatFault& fault = faults_.emplace_back();
  fault.line = at.line;
  fault.column = at.column;
  fault.message = std::move(message);
}

void FaultCollector::check_plausibility(const Rig& rig) {
  if (!faults_.empty()) return;
  MOCAP_EXPECTS(cameras_.size() == rig.size());
  for (const geometry::ImplausibleValue& value : geometry::implausible_values(rig))
    add(cameras_[value.camera], fmt::format("camera '{}': {}", rig[value.camera].name, value.message));
}

std::optional<double> number_of(const std::string& word) {
  const std::size_t begin = !word.empty() && word[0] == '+' ? 1 : 0;
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data() + begin, word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

void add_camera(const ForeignCamera& camera, Rig& rig, FaultCollector& faults) {
  const auto add_fault = [&](const std::string& what) {
    faults.add(camera.at, fmt::format("camera '{}': {}", camera.name, what));
  };
  if (std::ranges::find(rig, camera.name, &CameraModel::name) != rig.end())
    add_fault("occurs twice in this file, expected a different name for each camera");
  for (const double side : {camera.width_px, camera.height_px}) {
    if (side >= 1.0 && side <= kMaxSize_px && side == std::floor(side)) continue;
    add_fault(fmt::format("image size is {} x {}, expected whole px, 1 to {}", camera.width_px, camera.height_px,
                          kMaxSize_px));
    break;
  }
  if (!(camera.lens.fx_px > 0.0 && camera.lens.fy_px > 0.0)) {
    add_fault(fmt::format("focal length is {} x {} px, expected more than 0", camera.lens.fx_px, camera.lens.fy_px));
  }
  const Eigen::Matrix3d& r = camera.rotation;
  const double deviation = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = r.determinant();
  if (!(deviation <= kRotationTolerance)) {
    add_fault(fmt::format("rotation is not orthonormal: R R^T differs from the identity by {:.3g}", deviation));
  } else if (determinant < 0.0) {
    add_fault("rotation has determinant -1: the world is mirrored; expected a right-handed world");
  }
  CameraModel model;
  model.name = camera.name;
  model.width_px = static_cast<int>(std::clamp(camera.width_px, 0.0, kMaxSize_px));
  model.height_px = static_cast<int>(std::clamp(camera.height_px, 0.0, kMaxSize_px));
  model.lens = camera.lens;
  model.camera_from_world = {Eigen::Quaterniond(r).normalized().toRotationMatrix(), camera.translation_m};
  rig.push_back(std::move(model));
  faults.place_camera(camera.at);
}

std::string pose2sim_text(const Rig& rig) {
  std::string text;
  int number = 0;
  for (const CameraModel& camera : rig) {
    const Lens& lens = camera.lens;
    const auto& d = lens.distortion;
    const bool fisheye = lens.kind == LensKind::Fisheye;
    const Eigen::AngleAxisd rotation{Eigen::Quaterniond(camera.camera_from_world.rotation).normalized()};
    const Eigen::Vector3d r = rotation.angle() * rotation.axis();
    const Eigen::Vector3d& t = camera.camera_from_world.translation;
    // Numbered tables, because other programs sort the tables by name.
    text += fmt::format("[cam_{:02}]\nname = {}\n", ++number, quoted_text(camera.name));
    text += fmt::format("size = {}\n", list_text({double(camera.width_px), double(camera.height_px)}));
    text += fmt::format("matrix = [{}, {}, {}]\n", list_text({lens.fx_px, 0.0, lens.cx_px}),
                        list_text({0.0, lens.fy_px, lens.cy_px}), list_text({0.0, 0.0, 1.0}));
    const bool four = fisheye || d[4] == 0.0;  // Pose2Sim writes four coefficients
    text += fmt::format("distortions = {}\n",
                        four ? list_text({d[0], d[1], d[2], d[3]}) : list_text({d[0], d[1], d[2], d[3], d[4]}));
    text += fmt::format("rotation = {}\ntranslation = {}\nfisheye = {}\n\n", list_text({r[0], r[1], r[2]}),
                        list_text({t[0], t[1], t[2]}), fisheye);
  }
  return text + "[metadata]\nadjusted = false\nerror = 0.0\n";
}

Result<ParsedRig, FormatFaults> parse_rig(RigFormat format, const std::string& text, const std::string& default_name) {
  MOCAP_EXPECTS(format != RigFormat::Pose2Sim);
  if (format == RigFormat::OpenCv) return parse_opencv(text, default_name);
  if (format == RigFormat::Kalibr) return parse_kalibr(text);
  return parse_qca(text);
}

Result<RigText> rig_text(const Rig& rig, RigFormat format) {
  RigText written;
  switch (format) {
    case RigFormat::OpenCv: written.text = opencv_text(rig); break;
    case RigFormat::Kalibr: written = kalibr_text(rig); break;
    case RigFormat::Pose2Sim: written.text = pose2sim_text(rig); break;
    case RigFormat::Qca:
      return Error{ErrorCode::Unsupported, "qca files are read only; export to opencv, kalibr or pose2sim"};
  }
  for (const CameraModel& camera : rig) {
    if (camera.masks.empty() && camera.learnt_masks.empty()) continue;
    written.notices.push_back(
        fmt::format("camera '{}': {} files cannot hold masks: its masks are left out", camera.name, name_of(format)));
  }
  return written;
}

}  // namespace mocap::calibration
