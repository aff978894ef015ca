#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <initializer_list>

#include "base/literal_text.h"
#include "calibration/formats/yaml_camera.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

using CameraStep = RigidTransform<CameraPoint, CameraPoint>;

// The camera of a ROS topic: "/north-east/image_raw" is north-east.
std::string name_in_topic(const std::string& topic) {
  const std::size_t begin = topic.find_first_not_of('/');
  if (begin == std::string::npos) return {};
  return topic.substr(begin, topic.find('/', begin) - begin);
}

std::string name_of_camera(const std::string& key, const YamlValue& table) {
  const YamlValue* name = table.find({"name"});
  if (name != nullptr && name->kind == YamlValue::Kind::Word && !name->word.empty()) return name->word;
  const YamlValue* topic = table.find({"rostopic"});
  const std::string by_topic = topic != nullptr ? name_in_topic(topic->word) : std::string();
  return by_topic.empty() ? key : by_topic;
}

void read_model(YamlCamera& camera, Lens& lens) {
  const YamlValue* model = camera.require({"camera_model"}, "pinhole");
  if (model != nullptr && model->word != "pinhole") {
    camera.add_fault(
        *model, fmt::format("camera_model is '{}', expected pinhole: other models are not supported", model->word));
  }
  if (const YamlValue* intrinsics = camera.require({"intrinsics"}, "[fu, fv, pu, pv] in px")) {
    if (const auto f = camera.numbers(*intrinsics, "intrinsics", {4})) {
      lens.fx_px = (*f)[0];
      lens.fy_px = (*f)[1];
      lens.cx_px = (*f)[2];
      lens.cy_px = (*f)[3];
    }
  }
  const YamlValue* distortion = camera.require({"distortion_model"}, "radtan, equidistant or none");
  if (distortion == nullptr || distortion->word == "none") return;
  if (distortion->word != "radtan" && distortion->word != "equidistant") {
    camera.add_fault(*distortion,
                     fmt::format("distortion_model is '{}', expected radtan, equidistant or none", distortion->word));
    return;
  }
  const bool fisheye = distortion->word == "equidistant";
  lens.kind = fisheye ? LensKind::Fisheye : LensKind::Pinhole;
  const YamlValue* coefficients = camera.require({"distortion_coeffs"}, "four numbers");
  if (coefficients == nullptr) return;
  const auto d = fisheye ? camera.numbers(*coefficients, "distortion_coeffs", {4})
                         : camera.numbers(*coefficients, "distortion_coeffs", {4, 5});
  if (d) std::copy(d->begin(), d->end(), lens.distortion.data());
}

// A rigid transform as a 4x4 matrix.
std::optional<CameraStep> read_step(YamlCamera& camera, const YamlValue& value, const char* key) {
  const auto m = camera.numbers(value, key, {16});
  if (!m) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(m->data());
  if ((matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).norm() > 1e-9) {
    camera.add_fault(value, fmt::format("last row of {} is [{}, {}, {}, {}], expected [0, 0, 0, 1]", key, (*m)[12],
                                        (*m)[13], (*m)[14], (*m)[15]));
    return std::nullopt;
  }
  return CameraStep{matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()};
}

// The pose of the camera: relative to the camera before it, or to the world (the first camera, or a chain with an IMU).
std::optional<CameraStep> read_kalibr_pose(YamlCamera& camera, bool first, const CameraStep& before) {
  if (const YamlValue* step = camera.table().find({"T_cn_cnm1"})) {
    const auto read = read_step(camera, *step, "T_cn_cnm1");
    if (!read) return std::nullopt;
    return *read * before;
  }
  if (const YamlValue* imu = camera.table().find({"T_cam_imu"})) return read_step(camera, *imu, "T_cam_imu");
  if (!first) {
    camera.require({"T_cn_cnm1"}, "a 4x4 matrix: this camera from the camera before it");
    return std::nullopt;
  }
  return CameraStep{};
}

std::string matrix_rows(const Matrix3d& r, const Vector3d& t) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += fmt::format("  - {}\n", list_text({r(i, 0), r(i, 1), r(i, 2), t[i]}));
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

// A camera behind a gap in the numbers would be left out, and the pose of a camera is relative to the one before it.
void report_unread_cameras(const YamlValue& root, int count, FaultCollector& faults) {
  for (const auto& [key, table] : root.table) {
    if (!key.starts_with("cam") || key.size() == 3 || key.find_first_not_of("0123456789", 3) != std::string::npos)
      continue;
    bool is_read = false;
    for (int number = 0; number < count; ++number) is_read = is_read || key == fmt::format("cam{}", number);
    if (!is_read) {
      faults.add(table.at,
                 fmt::format("has {}, but no cam{}: expected cam0, cam1, ... without a gap; number the cameras "
                             "anew, with T_cn_cnm1 from the camera before",
                             key, count));
    }
  }
}

}  // namespace

// Source: Kalibr's wiki, "Yaml formats". As in mrcal's files, T_cn_cnm1 of the first camera is from the world.
Result<ParsedRig, FormatFaults> parse_kalibr(const std::string& text) {
  const auto root = parse_yaml(text);
  if (!root) return root.error();
  FaultCollector faults;
  ParsedRig read;
  CameraStep before;
  int number = 0;
  for (;; ++number) {
    const std::string key = fmt::format("cam{}", number);
    const YamlValue* table = root->find({key.c_str()});
    if (table == nullptr) break;
    YamlCamera camera(name_of_camera(key, *table), *table, faults);
    ForeignCamera foreign;
    foreign.name = camera.name();
    foreign.at = table->at;
    read_model(camera, foreign.lens);
    if (const YamlValue* size = camera.require({"resolution"}, "[width, height] in px")) {
      if (const auto sides = camera.numbers(*size, "resolution", {2})) {
        foreign.width_px = (*sides)[0];
        foreign.height_px = (*sides)[1];
      }
    }
    const auto pose = read_kalibr_pose(camera, number == 0, before);
    if (!pose || !camera.is_valid()) continue;
    foreign.rotation = pose->rotation;
    foreign.translation_m = pose->translation;
    before = *pose;
    add_camera(foreign, read.rig, faults);
  }
  report_unread_cameras(*root, number, faults);
  if (read.rig.empty() && faults.empty()) {
    faults.add({}, "has no cam0, expected a camchain: cam0, cam1, ... each with camera_model and intrinsics");
  }
  faults.check_plausibility(read.rig);
  if (!faults.empty()) return faults.faults();
  const YamlValue* first = root->find({"cam0"});
  if (first->find({"T_cn_cnm1", "T_cam_imu"}) == nullptr) {
    read.notices.emplace_back(
        "the world is the frame of the first camera: measure the floor with mocap-calibrate floor");
  }
  return read;
}

RigText kalibr_text(const Rig& rig) {
  RigText written;
  CameraFromWorld before;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const CameraModel& camera = rig[i];
    const Lens& lens = camera.lens;
    const auto& d = lens.distortion;
    const bool fisheye = lens.kind == LensKind::Fisheye;
    const bool five = !fisheye && d[4] != 0.0;
    if (five) {
      written.notices.push_back(fmt::format(
          "camera '{}': k3 is {}; five distortion_coeffs are written, but Kalibr's radtan has k1 k2 p1 p2 only, and "
          "programs that expect four will refuse the file",
          camera.name, d[4]));
    }
    const Matrix3d& r = camera.camera_from_world.rotation;
    const Vector3d& t = camera.camera_from_world.translation;
    const Matrix3d step = i == 0 ? r : Matrix3d(r * before.rotation.transpose());
    const Vector3d moved = i == 0 ? t : Vector3d(t - step * before.translation);
    before = camera.camera_from_world;
    std::string& text = written.text;
    text += fmt::format("cam{}:\n  T_cn_cnm1:\n{}", i, matrix_rows(step, moved));
    text += "  cam_overlaps: []\n  camera_model: pinhole\n";
    text += fmt::format("  distortion_coeffs: {}\n",
                        five ? list_text({d[0], d[1], d[2], d[3], d[4]}) : list_text({d[0], d[1], d[2], d[3]}));
    text += fmt::format("  distortion_model: {}\n", fisheye ? "equidistant" : "radtan");
    text += fmt::format("  intrinsics: {}\n", list_text({lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px}));
    text += fmt::format("  name: {}\n", quoted_text(camera.name));
    text += fmt::format("  resolution: [{}, {}]\n", camera.width_px, camera.height_px);
    text += fmt::format("  rostopic: {}\n", quoted_text("/" + camera.name + "/image_raw"));
  }
  return written;
}

}  // namespace mocap::calibration
