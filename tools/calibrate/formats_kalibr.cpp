#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <initializer_list>

#include "calibrate/formats_numbers.h"
#include "settings/rig_text.h"

namespace mocap::calibrate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using settings::list_text;

using CameraStep = RigidTransform<CameraPoint, CameraPoint>;

// "/north-east/image_raw" is north-east's.
std::string name_in_topic(const std::string& topic) {
  const std::size_t begin = topic.find_first_not_of('/');
  if (begin == std::string::npos) return {};
  return topic.substr(begin, topic.find('/', begin) - begin);
}

std::string name_of_camera(const std::string& key, const YamlValue& table) {
  const YamlValue* name = table.find({"name"});
  if (name != nullptr && name->kind == YamlValue::Kind::Word && !name->word.empty()) return name->word;
  const YamlValue* topic = table.find({"rostopic"});
  const std::string told = topic != nullptr ? name_in_topic(topic->word) : std::string();
  return told.empty() ? key : told;
}

void read_model(YamlCamera& camera, Lens& lens) {
  const YamlValue* model = camera.require({"camera_model"}, "pinhole");
  if (model != nullptr && model->word != "pinhole") {
    camera.complain(
        *model, fmt::format("camera_model is '{}', expected pinhole: of others nothing is known here", model->word));
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
    camera.complain(*distortion,
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

// The camera from what `T` is told from: a 4x4 matrix.
std::optional<CameraStep> read_step(YamlCamera& camera, const YamlValue& value, const char* key) {
  const auto m = camera.numbers(value, key, {16});
  if (!m) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(m->data());
  if ((matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).norm() > 1e-9) {
    camera.complain(value, fmt::format("last row of {} is [{}, {}, {}, {}], expected [0, 0, 0, 1]", key, (*m)[12],
                                       (*m)[13], (*m)[14], (*m)[15]));
    return std::nullopt;
  }
  return CameraStep{matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()};
}

// Where the camera stands: from the one before it, or (the first, or a chain with an IMU) from the world.
std::optional<CameraStep> read_place(YamlCamera& camera, bool first, const CameraStep& before) {
  if (const YamlValue* step = camera.table().find({"T_cn_cnm1"})) {
    const auto read = read_step(camera, *step, "T_cn_cnm1");
    if (!read) return std::nullopt;
    return *read * before;
  }
  if (const YamlValue* imu = camera.table().find({"T_cam_imu"})) return read_step(camera, *imu, "T_cam_imu");
  if (!first) {
    camera.require({"T_cn_cnm1"}, "a 4x4 matrix: this camera from the one before it");
    return std::nullopt;
  }
  return CameraStep{};
}

std::string matrix_rows(const Matrix3d& r, const Vector3d& t) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += fmt::format("  - {}\n", list_text({r(i, 0), r(i, 1), r(i, 2), t[i]}));
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

}  // namespace

// Source: Kalibr's wiki, "Yaml formats". As mrcal writes it, the first camera's T_cn_cnm1 is from the world.
Result<ReadRig, settings::Faults> read_kalibr(const std::filesystem::path& path, const std::string& text) {
  const auto root = parse_yaml(path, text);
  if (!root) return root.error();
  Complaints complaints(path);
  ReadRig read;
  CameraStep before;
  for (int number = 0;; ++number) {
    const std::string key = fmt::format("cam{}", number);
    const YamlValue* table = root->find({key.c_str()});
    if (table == nullptr) break;
    YamlCamera camera(name_of_camera(key, *table), *table, complaints);
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
    const auto place = read_place(camera, number == 0, before);
    if (!place || !camera.sound()) continue;
    foreign.rotation = place->rotation;
    foreign.translation_m = place->translation;
    before = *place;
    add_camera(foreign, read.rig, complaints);
  }
  if (read.rig.empty() && complaints.empty()) {
    complaints.add({}, "holds no cam0, expected a camchain: cam0, cam1, ... each with camera_model and intrinsics");
  }
  if (!complaints.empty()) return complaints.faults();
  const YamlValue* first = root->find({"cam0"});
  if (first->find({"T_cn_cnm1", "T_cam_imu"}) == nullptr) {
    read.notices.emplace_back("the world is the first camera's frame: lay it on the floor with mocap-calibrate floor");
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
          "camera '{}': k3 is {}; Kalibr's radtan has k1 k2 p1 p2 only, and programs that know no more will "
          "refuse the five numbers that are written",
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
    text += fmt::format("  name: {}\n", settings::quoted_text(camera.name));
    text += fmt::format("  resolution: [{}, {}]\n", camera.width_px, camera.height_px);
    text += fmt::format("  rostopic: {}\n", settings::quoted_text("/" + camera.name + "/image_raw"));
  }
  return written;
}

}  // namespace mocap::calibrate
