#include "calibrate/formats_rig.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <charconv>
#include <cmath>

#include "calibrate/formats_reader.h"
#include "settings/rig_file.h"
#include "settings/rig_text.h"
#include "settings/text_file.h"

namespace mocap::calibrate {
namespace {

struct Named {
  RigFormat format;
  const char* name;
};
constexpr std::array<Named, 4> kNames{{{RigFormat::OpenCv, "opencv"},
                                       {RigFormat::Kalibr, "kalibr"},
                                       {RigFormat::Pose2Sim, "pose2sim"},
                                       {RigFormat::Qca, "qca"}}};

constexpr double kMostSize_px = 65536.0;
// Other programs write 6 to 17 digits; what is further off is no rotation.
constexpr double kRotationTolerance = 1e-4;

settings::Faults one_fault(const std::filesystem::path& path, std::string message) {
  return {path, {{path, 0, 0, std::move(message)}}};
}

bool has(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

std::optional<RigFormat> guess(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && text[first] == '<') {
    return has(text, "<calibration") ? std::optional(RigFormat::Qca) : std::nullopt;
  }
  if (has(text, "camera_model:") && has(text, "intrinsics:")) return RigFormat::Kalibr;
  if (has(text, "camera_matrix") && (has(text, "%YAML") || has(text, "camera_matrix:") || has(text, "!!opencv"))) {
    return RigFormat::OpenCv;
  }
  if (has(text, "[") && has(text, "matrix") && has(text, "translation") && has(text, "=")) return RigFormat::Pose2Sim;
  return std::nullopt;
}

Result<ReadRig, settings::Faults> read_as(RigFormat format, const std::filesystem::path& path,
                                          const std::string& text) {
  switch (format) {
    case RigFormat::OpenCv: return read_opencv(path, text);
    case RigFormat::Kalibr: return read_kalibr(path, text);
    case RigFormat::Qca: return read_qca(path, text);
    case RigFormat::Pose2Sim: break;
  }
  auto read = settings::load_foreign_rig(path);
  if (!read) return read.error();
  return ReadRig{std::move(read->rig), std::move(read->left_out)};
}

bool is_twice(const Rig& rig, const std::string& name) {
  for (const CameraModel& camera : rig) {
    if (camera.name == name) return true;
  }
  return false;
}

}  // namespace

std::optional<RigFormat> format_named(std::string_view name) {
  for (const Named& named : kNames) {
    if (name == named.name) return named.format;
  }
  return std::nullopt;
}

const char* name_of(RigFormat format) {
  for (const Named& named : kNames) {
    if (format == named.format) return named.name;
  }
  return "";
}

void Complaints::add(const Place& at, std::string message) {
  faults_.list.push_back({faults_.file, at.line, at.column, std::move(message)});
}

std::optional<double> number_of(const std::string& word) {
  const std::size_t begin = !word.empty() && word[0] == '+' ? 1 : 0;
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data() + begin, word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

void add_camera(const ForeignCamera& camera, Rig& rig, Complaints& complaints) {
  const auto complain = [&](const std::string& what) {
    complaints.add(camera.at, fmt::format("camera '{}': {}", camera.name, what));
  };
  if (is_twice(rig, camera.name)) complain("is in this file twice, expected a name of its own for each camera");
  for (const double side : {camera.width_px, camera.height_px}) {
    if (side >= 1.0 && side <= kMostSize_px && side == std::floor(side)) continue;
    complain(fmt::format("image size is {} x {}, expected whole px, 1 to {}", camera.width_px, camera.height_px,
                         kMostSize_px));
    break;
  }
  if (!(camera.lens.fx_px > 0.0 && camera.lens.fy_px > 0.0)) {
    complain(fmt::format("focal length is {} x {} px, expected more than 0", camera.lens.fx_px, camera.lens.fy_px));
  }
  const Eigen::Matrix3d& r = camera.rotation;
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = r.determinant();
  if (!(off <= kRotationTolerance)) {
    complain(fmt::format("its rotation is none: R R^T is {:.3g} off the identity, expected orthonormal rows", off));
  } else if (determinant < 0.0) {
    complain("its rotation has determinant -1: the world is mirrored; expected a right-handed one");
  }
  CameraModel model;
  model.name = camera.name;
  model.width_px = static_cast<int>(std::clamp(camera.width_px, 0.0, kMostSize_px));
  model.height_px = static_cast<int>(std::clamp(camera.height_px, 0.0, kMostSize_px));
  model.lens = camera.lens;
  model.camera_from_world = {Eigen::Quaterniond(r).normalized().toRotationMatrix(), camera.translation_m};
  rig.push_back(std::move(model));
}

std::string pose2sim_text(const Rig& rig) {
  using settings::list_text;
  std::string text;
  int number = 0;
  for (const CameraModel& camera : rig) {
    const Lens& lens = camera.lens;
    const auto& d = lens.distortion;
    const bool fisheye = lens.kind == LensKind::Fisheye;
    const Eigen::AngleAxisd turn{Eigen::Quaterniond(camera.camera_from_world.rotation).normalized()};
    const Eigen::Vector3d r = turn.angle() * turn.axis();
    const Eigen::Vector3d& t = camera.camera_from_world.translation;
    // Other programs sort the tables by their names.
    text += fmt::format("[cam_{:02}]\nname = {}\n", ++number, settings::quoted_text(camera.name));
    text += fmt::format("size = {}\n", list_text({double(camera.width_px), double(camera.height_px)}));
    text += fmt::format("matrix = [{}, {}, {}]\n", list_text({lens.fx_px, 0.0, lens.cx_px}),
                        list_text({0.0, lens.fy_px, lens.cy_px}), list_text({0.0, 0.0, 1.0}));
    const bool four = fisheye || d[4] == 0.0;  // Pose2Sim itself writes four
    text += fmt::format("distortions = {}\n",
                        four ? list_text({d[0], d[1], d[2], d[3]}) : list_text({d[0], d[1], d[2], d[3], d[4]}));
    text += fmt::format("rotation = {}\ntranslation = {}\nfisheye = {}\n\n", list_text({r[0], r[1], r[2]}),
                        list_text({t[0], t[1], t[2]}), fisheye);
  }
  return text + "[metadata]\nadjusted = false\nerror = 0.0\n";
}

Result<ReadRig, settings::Faults> read_rig(const std::filesystem::path& path, std::optional<RigFormat> format) {
  const auto text = settings::read_text(path);
  if (!text) return settings::Faults{path, {text.error()}};
  if (!format) format = guess(*text);
  if (!format) {
    return one_fault(path, "is in no format that it could be told from; say --format opencv, kalibr, pose2sim or qca");
  }
  return read_as(*format, path, *text);
}

Result<RigText> rig_text(const Rig& rig, RigFormat format) {
  RigText written;
  switch (format) {
    case RigFormat::OpenCv: written.text = opencv_text(rig); break;
    case RigFormat::Kalibr: written = kalibr_text(rig); break;
    case RigFormat::Pose2Sim: written.text = pose2sim_text(rig); break;
    case RigFormat::Qca: return Error{ErrorCode::Unsupported, "qca is only read; export to opencv, kalibr or pose2sim"};
  }
  for (const CameraModel& camera : rig) {
    if (camera.masks.empty() && camera.learnt_masks.empty()) continue;
    written.notices.push_back(
        fmt::format("camera '{}': its masks have no place in {} and are left out", camera.name, name_of(format)));
  }
  return written;
}

}  // namespace mocap::calibrate
