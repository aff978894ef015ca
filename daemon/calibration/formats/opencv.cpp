#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/literal_text.h"
#include "calibration/formats/yaml_camera.h"
#include "geometry/plausible_rig.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Keys of OpenCV's samples, and common variants.
constexpr std::initializer_list<const char*> kMatrix{"camera_matrix", "cameraMatrix", "Camera_Matrix", "K"};
constexpr std::initializer_list<const char*> kDistortion{"distortion_coefficients", "distCoeffs", "dist_coeffs",
                                                         "Distortion_Coefficients", "D"};
constexpr std::initializer_list<const char*> kRotation{"rotation", "R", "rvec", "rotation_matrix"};
constexpr std::initializer_list<const char*> kTranslation{"translation", "T", "tvec", "translation_vector"};

// OpenCV's matrices are tables, too.
bool is_matrix(const YamlValue& table) { return table.find({"data"}) != nullptr; }

bool is_set(const YamlValue* value) {
  return value != nullptr &&
         (value->word == "1" || value->word == "true" || value->word == "equidistant" || value->word == "fisheye");
}

void read_matrix(YamlCamera& camera, Lens& lens) {
  const YamlValue* value = camera.require(kMatrix, "a 3x3 matrix in px");
  const auto m = value != nullptr ? camera.numbers(*value, "camera_matrix", {9}) : std::nullopt;
  if (!m) return;
  if ((*m)[1] != 0.0 || (*m)[3] != 0.0) {
    camera.add_fault(*value,
                     fmt::format("camera_matrix has a skew of {}, expected 0", (*m)[1] != 0.0 ? (*m)[1] : (*m)[3]));
  }
  if ((*m)[6] != 0.0 || (*m)[7] != 0.0 || (*m)[8] != 1.0) {
    camera.add_fault(*value, fmt::format("last row of camera_matrix is [{}, {}, {}], expected [0, 0, 1]", (*m)[6],
                                         (*m)[7], (*m)[8]));
  }
  lens.fx_px = (*m)[0];
  lens.fy_px = (*m)[4];
  lens.cx_px = (*m)[2];
  lens.cy_px = (*m)[5];
}

void read_distortion(YamlCamera& camera, Lens& lens) {
  const YamlValue& table = camera.table();
  const bool fisheye = is_set(table.find({"fisheye_model", "fisheye"})) || is_set(table.find({"distortion_model"}));
  lens.kind = fisheye ? LensKind::Fisheye : LensKind::Pinhole;
  const YamlValue* value = table.find(kDistortion);
  if (value == nullptr) return;  // no distortion
  const auto d = fisheye ? camera.numbers(*value, "distortion_coefficients", {4})
                         : camera.numbers(*value, "distortion_coefficients", {4, 5, 8, 12, 14});
  if (!d) return;
  for (std::size_t i = 5; i < d->size(); ++i) {
    if ((*d)[i] == 0.0) continue;
    camera.add_fault(*value, fmt::format("distortion_coefficients has {} as its number {}, expected 0: of OpenCV's "
                                         "pinhole model only k1 k2 p1 p2 k3 are supported",
                                         (*d)[i], i + 1));
    break;
  }
  std::copy_n(d->begin(), std::min<std::size_t>(5, d->size()), lens.distortion.data());
}

void read_size(YamlCamera& camera, ForeignCamera& foreign) {
  const YamlValue* both = camera.table().find({"image_size", "imageSize", "size"});
  if (both != nullptr) {
    if (const auto sides = camera.numbers(*both, "image_size", {2})) {
      foreign.width_px = (*sides)[0];
      foreign.height_px = (*sides)[1];
    }
    return;
  }
  const YamlValue* width = camera.require({"image_width", "image_Width", "width"}, "the image's width in px");
  const YamlValue* height = camera.require({"image_height", "image_Height", "height"}, "the image's height in px");
  const auto w = width != nullptr ? camera.numbers(*width, "image_width", {1}) : std::nullopt;
  const auto h = height != nullptr ? camera.numbers(*height, "image_height", {1}) : std::nullopt;
  if (!w || !h) return;
  foreign.width_px = w->front();
  foreign.height_px = h->front();
}

// Reads the pose; false if the file has none.
bool read_pose(YamlCamera& camera, ForeignCamera& foreign) {
  const YamlValue* rotation = camera.table().find(kRotation);
  const YamlValue* translation = camera.table().find(kTranslation);
  if (rotation == nullptr && translation == nullptr) return false;
  if (rotation == nullptr) camera.require(kRotation, "a 3x3 matrix or a Rodrigues vector, camera from world");
  if (translation == nullptr) camera.require(kTranslation, "[x, y, z] in m");
  if (rotation == nullptr || translation == nullptr) return true;
  if (const auto r = camera.numbers(*rotation, "rotation", {3, 9})) {
    if (r->size() == 9) {
      foreign.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
    } else {
      const Vector3d vector((*r)[0], (*r)[1], (*r)[2]);
      if (const auto fault = geometry::rotation_vector_fault(vector)) camera.add_fault(*rotation, *fault);
      const double angle = vector.norm();
      if (angle > 0.0) foreign.rotation = Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
    }
  }
  if (const auto t = camera.numbers(*translation, "translation", {3})) foreign.translation_m = Vector3d(t->data());
  return true;
}

/// Reads all cameras of a document.
class OpenCvFile {
 public:
  explicit OpenCvFile(const std::string& default_name) : default_name_(default_name) {}

  void read(const YamlValue& root) {
    const YamlValue* cameras = root.find({"cameras"});
    const bool is_camera = root.find(kMatrix) != nullptr;
    if (is_camera) {
      add(default_name_, root);
    } else if (cameras != nullptr) {
      for (const YamlValue& table : cameras->list) add(fmt::format("cam{}", ++number_), table);
      for (const auto& [key, table] : cameras->table) add(key, table);
    }
    for (const auto& [key, table] : root.table) {
      if (table.kind != YamlValue::Kind::Table || is_matrix(table) || (!is_camera && &table == cameras)) continue;
      if (!is_camera && cameras == nullptr && (table.find(kMatrix) != nullptr || table.find(kDistortion) != nullptr)) {
        add(key, table);
      } else {
        read_.notices.push_back(
            fmt::format("line {}: '{}' is left out, expected a camera with camera_matrix", table.at.line, key));
      }
    }
  }

  Result<ParsedRig, FormatFaults> result() {
    if (read_.rig.empty() && faults_.empty()) {
      faults_.add({}, "has no camera, expected camera_matrix at the top level, in tables, or in a list `cameras`");
    }
    faults_.check_plausibility(read_.rig);
    if (!faults_.empty()) return faults_.faults();
    return std::move(read_);
  }

 private:
  void add(const std::string& key, const YamlValue& table) {
    const YamlValue* name = table.find({"name", "camera_name"});
    const bool named = name != nullptr && !name->word.empty();
    YamlCamera camera(named ? name->word : key, table, faults_);
    ForeignCamera foreign;
    foreign.name = camera.name();
    foreign.at = table.at;
    read_matrix(camera, foreign.lens);
    read_distortion(camera, foreign.lens);
    read_size(camera, foreign);
    const bool has_pose = read_pose(camera, foreign);
    if (!camera.is_valid()) return;
    if (!has_pose) {
      read_.notices.push_back(
          fmt::format("camera '{}': the file has no pose for it; only its lens is known", camera.name()));
    }
    add_camera(foreign, read_.rig, faults_);
  }

  FaultCollector faults_;
  std::string default_name_;
  ParsedRig read_;
  int number_ = 0;
};

std::string matrix_text(const char* key, int rows, int columns, std::initializer_list<double> values) {
  return fmt::format(
      "      {}: !!opencv-matrix\n         rows: {}\n         cols: {}\n         dt: d\n         data: {}\n", key, rows,
      columns, list_text(values));
}

}  // namespace

// Source: the OpenCV documentation, "File Input and Output using XML and YAML files", and its calibration sample.
Result<ParsedRig, FormatFaults> parse_opencv(const std::string& text, const std::string& default_name) {
  const auto root = parse_yaml(text);
  if (!root) return root.error();
  OpenCvFile file(default_name);
  file.read(*root);
  return file.result();
}

std::string opencv_text(const Rig& rig) {
  std::string text = fmt::format("%YAML:1.0\n---\nnr_cameras: {}\ncameras:\n", rig.size());
  for (const CameraModel& camera : rig) {
    const Lens& lens = camera.lens;
    const auto& d = lens.distortion;
    const bool fisheye = lens.kind == LensKind::Fisheye;
    const Matrix3d& r = camera.camera_from_world.rotation;
    const Vector3d& t = camera.camera_from_world.translation;
    text += fmt::format("   -\n      name: {}\n", quoted_text(camera.name));
    text += fmt::format("      image_width: {}\n      image_height: {}\n", camera.width_px, camera.height_px);
    text += fmt::format("      fisheye_model: {}\n", fisheye ? 1 : 0);
    text += matrix_text("camera_matrix", 3, 3, {lens.fx_px, 0., lens.cx_px, 0., lens.fy_px, lens.cy_px, 0., 0., 1.});
    text += fisheye ? matrix_text("distortion_coefficients", 4, 1, {d[0], d[1], d[2], d[3]})
                    : matrix_text("distortion_coefficients", 5, 1, {d[0], d[1], d[2], d[3], d[4]});
    text += matrix_text("rotation", 3, 3,
                        {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)});
    text += matrix_text("translation", 3, 1, {t[0], t[1], t[2]});
  }
  return text;
}

}  // namespace mocap::calibration
