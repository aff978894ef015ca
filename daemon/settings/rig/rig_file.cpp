#include "settings/rig/rig_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "base/replace_file.h"
#include "geometry/plausible_rig.h"
#include "model/image_bounds.h"
#include "settings/rig/rig_text.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

// Other programs write rotations with 6 to 17 digits. A larger error is no rounding.
constexpr double kRotationTolerance = 1e-4;
constexpr double kMaxSize_px = kMaxImageSide_px;

// The nearest rotation: rounding by other programs must not scale the world.
Eigen::Matrix3d made_orthonormal(const Eigen::Matrix3d& near_rotation) {
  return Eigen::Quaterniond(near_rotation).normalized().toRotationMatrix();
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rodrigues) {
  const double angle = rodrigues.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rodrigues / angle).toRotationMatrix();
}

Eigen::Vector3d rodrigues_of(const Eigen::Matrix3d& rotation) {
  // The quaternion is exact near 0 and 180 degrees; the trace of the matrix is not.
  const Eigen::AngleAxisd angle_axis{Eigen::Quaterniond(rotation).normalized()};
  return angle_axis.angle() * angle_axis.axis();
}

void read_size(TomlTable& table, CameraModel& camera) {
  if (!table.require("size", "[width, height] in px")) return;
  const auto size = table.list("size", {2});
  if (!size) return;
  for (const double side : *size) {
    if (side < 1.0 || side > kMaxSize_px || side != std::floor(side)) {
      table.fault("size",
                  fmt::format("size is [{}, {}], expected whole px, 1 to {}", (*size)[0], (*size)[1], kMaxSize_px));
      return;
    }
  }
  camera.width_px = static_cast<int>((*size)[0]);
  camera.height_px = static_cast<int>((*size)[1]);
}

void read_matrix(TomlTable& table, Lens& lens) {
  if (!table.require("matrix", "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in px")) return;
  const auto m = table.matrix("matrix", 3, 3);
  if (!m) return;
  const auto at = [&](std::size_t row, std::size_t column) { return (*m)[3 * row + column]; };
  if (at(0, 0) <= 0.0 || at(1, 1) <= 0.0) {
    table.fault("matrix", fmt::format("focal length is [{}, {}] px, expected more than 0", at(0, 0), at(1, 1)));
  }
  if (at(0, 1) != 0.0 || at(1, 0) != 0.0) {
    table.fault("matrix", fmt::format("matrix has a skew of {}, expected 0", at(0, 1) != 0.0 ? at(0, 1) : at(1, 0)));
  }
  if (at(2, 0) != 0.0 || at(2, 1) != 0.0 || at(2, 2) != 1.0) {
    table.fault("matrix",
                fmt::format("last row of matrix is [{}, {}, {}], expected [0, 0, 1]", at(2, 0), at(2, 1), at(2, 2)));
  }
  lens.fx_px = at(0, 0);
  lens.fy_px = at(1, 1);
  lens.cx_px = at(0, 2);
  lens.cy_px = at(1, 2);
}

void read_lens(TomlTable& table, Lens& lens) {
  bool fisheye = false;
  table.flag("fisheye", fisheye);
  lens.kind = fisheye ? LensKind::Fisheye : LensKind::Pinhole;
  table.flag(kLensFromFov, lens.is_from_fov);
  read_matrix(table, lens);
  if (!table.has("distortions")) return table.ignore("distortions");  // a lens without distortion
  const auto distortions = fisheye ? table.list("distortions", {4}) : table.list("distortions", {4, 5});
  if (!distortions) return;
  for (std::size_t i = 0; i < distortions->size(); ++i)
    lens.distortion[static_cast<Eigen::Index>(i)] = (*distortions)[i];
}

void read_rotation(TomlTable& table, Eigen::Matrix3d& rotation) {
  if (!table.require("rotation", "a Rodrigues vector, rad, camera from world")) return;
  if (!table.has_matrix("rotation")) {
    if (const auto list = table.list("rotation", {3})) {
      const Eigen::Vector3d vector((*list)[0], (*list)[1], (*list)[2]);
      if (const auto fault = geometry::rotation_vector_fault(vector)) table.fault("rotation", *fault);
      rotation = rotation_of(vector);
    }
    return;
  }
  const auto rows = table.matrix("rotation", 3, 3);
  if (!rows) return;
  const Eigen::Matrix3d found = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows->data());
  const double error = (found * found.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = found.determinant();
  if (error > kRotationTolerance || determinant < 0.0) {
    table.fault("rotation",
                fmt::format("matrix is no rotation: R R^T is {:.3g} off the identity, determinant {:.4g}; expected "
                            "orthonormal rows and determinant 1",
                            error, determinant));
    return;
  }
  rotation = made_orthonormal(found);
}

CameraModel read_camera(TomlTable& table, const std::string& key) {
  CameraModel camera;
  camera.name = key;
  table.text("name", camera.name);
  if (camera.name.empty()) table.fault("name", "name is '', expected the camera's name");
  if (camera.name == kRigMetadata)
    table.fault("name", fmt::format("name is '{}', the name of the table with facts about the rig; rename the camera",
                                    camera.name));
  table.call(fmt::format("camera '{}'", camera.name));
  read_size(table, camera);
  read_lens(table, camera.lens);
  read_rotation(table, camera.camera_from_world.rotation);
  if (table.require("translation", "[x, y, z] in m")) {
    if (const auto t = table.list("translation", {3}))
      camera.camera_from_world.translation = {(*t)[0], (*t)[1], (*t)[2]};
  }
  if (auto masks = table.polygons(kDrawnMask)) camera.masks = *std::move(masks);
  if (auto masks = table.polygons(kLearntMask)) camera.learnt_masks = *std::move(masks);
  table.done();
  return camera;
}

bool is_in(const Rig& rig, const std::string& name) {
  for (const CameraModel& camera : rig) {
    if (camera.name == name) return true;
  }
  return false;
}

std::string text_of(const std::string& value) { return quoted_text(value); }
std::string text_of(double value) { return number_text(value); }
std::string text_of(bool value) { return value ? "true" : "false"; }

std::string text_of(const CameraModel& camera) {
  const Lens& lens = camera.lens;
  const auto& d = lens.distortion;
  const Eigen::Vector3d r = rodrigues_of(camera.camera_from_world.rotation);
  const Eigen::Vector3d& t = camera.camera_from_world.translation;
  const bool fisheye = lens.kind == LensKind::Fisheye;
  std::string text = fmt::format("[{}]\n", text_of(camera.name));
  text += fmt::format("name = {}\n", text_of(camera.name));
  text += fmt::format("size = [{}, {}]\n", camera.width_px, camera.height_px);
  text += fmt::format("matrix = [{}, {}, {}]\n", list_text({lens.fx_px, 0.0, lens.cx_px}),
                      list_text({0.0, lens.fy_px, lens.cy_px}), list_text({0.0, 0.0, 1.0}));
  text += fmt::format("distortions = {}\n",
                      fisheye ? list_text({d[0], d[1], d[2], d[3]}) : list_text({d[0], d[1], d[2], d[3], d[4]}));
  text += fmt::format("rotation = {}\n", list_text({r[0], r[1], r[2]}));
  text += fmt::format("translation = {}\n", list_text({t[0], t[1], t[2]}));
  text += fmt::format("fisheye = {}\n", text_of(fisheye));
  if (lens.is_from_fov) text += fmt::format("{} = true\n", kLensFromFov);
  if (!camera.masks.empty()) text += fmt::format("{} = {}\n", kDrawnMask, mask_text(camera.masks));
  if (!camera.learnt_masks.empty()) text += fmt::format("{} = {}\n", kLearntMask, mask_text(camera.learnt_masks));
  return text + "\n";
}

constexpr const char* kCameraKeys[] = {"name",        "size",    "matrix",     "distortions", "rotation",
                                       "translation", "fisheye", kLensFromFov, kDrawnMask,    kLearntMask};

// Keys of other programs in a camera's table.
void leave_out_unknown(TomlTable& table, const std::string& key, std::vector<std::string>& left_out) {
  for (const std::string& own : table.keys()) {
    if (std::ranges::find(kCameraKeys, own) != std::end(kCameraKeys)) continue;
    table.ignore(own);
    left_out.push_back(fmt::format("[{}] has '{}', which a rig has no place for; it is left out", key, own));
  }
}

const char* key_of(geometry::RigPart part) {
  switch (part) {
    case geometry::RigPart::Matrix: return "matrix";
    case geometry::RigPart::Translation: return "translation";
  }
  return "";
}

// `tables`: of the cameras, in the order of the rig.
void check_plausibility(const Rig& rig, std::vector<TomlTable>& tables) {
  for (const geometry::ImplausibleValue& value : geometry::implausible_values(rig))
    tables[value.camera].fault(key_of(value.part), value.message);
}

Result<ForeignRig, Faults> read_rig(const std::filesystem::path& path, bool foreign) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  TomlTable root = file->root();
  ForeignRig read;
  std::vector<TomlTable> cameras;
  for (const std::string& key : root.keys()) {
    std::optional<TomlTable> table = root.table(key, fmt::format("camera '{}'", key));
    if (!table || key == kRigMetadata) continue;
    if (foreign && !table->has("matrix") && !table->has("size")) {
      read.left_out.push_back(fmt::format("[{}] is no camera; it is left out", key));
      continue;
    }
    if (foreign) leave_out_unknown(*table, key, read.left_out);
    CameraModel camera = read_camera(*table, key);
    if (is_in(read.rig, camera.name)) table->fault("name", "is in this rig twice, expected one table per camera");
    read.rig.push_back(std::move(camera));
    cameras.push_back(*std::move(table));
  }
  if (read.rig.empty()) root.fault("no camera in this rig, expected one table per camera");
  if (file->faults().list.empty()) check_plausibility(read.rig, cameras);
  if (!file->faults().list.empty()) return file->faults();
  return read;
}

}  // namespace

Result<Rig, Faults> load_rig(const std::filesystem::path& path) {
  auto read = read_rig(path, false);
  if (!read) return read.error();
  return std::move(read->rig);
}

bool floor_is_guessed(const std::filesystem::path& path) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return false;
  std::optional<TomlTable> facts = file->root().table(kRigMetadata, kRigMetadata);
  std::string floor;
  if (facts && facts->has("floor")) facts->text("floor", floor);
  return floor == "guessed";
}

Result<ForeignRig, Faults> load_foreign_rig(const std::filesystem::path& path) { return read_rig(path, true); }

Status save_rig(const std::filesystem::path& path, const Rig& rig, const RigMetadata& metadata) {
  if (is_in(rig, kRigMetadata)) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{}: not written: a camera is named '{}', the name of the table with facts about the rig; "
                             "rename the camera",
                             path.string(), kRigMetadata)};
  }
  std::string text;
  for (const CameraModel& camera : rig) text += text_of(camera);
  text += fmt::format("[{}]\n", kRigMetadata);
  for (const auto& [key, value] : metadata) {
    text += fmt::format("{} = {}\n", text_of(key), std::visit([](const auto& v) { return text_of(v); }, value));
  }
  return replace_file(path, text);
}

}  // namespace mocap::settings
