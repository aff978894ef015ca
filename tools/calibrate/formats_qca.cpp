#include <fmt/format.h>

#include <cmath>

#include "calibrate/formats_reader.h"

namespace mocap::calibrate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Lengths on the sensor are in 64ths of a pixel; distortion has no unit and is OpenCV's.
constexpr double kUnits = 64.0;
constexpr double kM = 1e-3;

class QcaCamera {
 public:
  QcaCamera(const XmlElement& camera, Complaints& complaints) : camera_(camera), complaints_(complaints) {
    const std::string* serial = camera.attribute("serial");
    name_ = serial != nullptr ? *serial : std::string();
    if (name_.empty()) complaints.add(camera.at, "<camera> has no serial, expected serial=\"name\"");
  }

  const std::string& name() const { return name_; }

  void add_to(Rig& rig) {
    ForeignCamera foreign;
    foreign.name = name_;
    foreign.at = camera_.at;
    const XmlElement* intrinsic = part({"intrinsic"});
    const XmlElement* transform = part({"transform"});
    const XmlElement* view = part({"fov_video", "fov_marker"});
    if (intrinsic == nullptr || transform == nullptr || view == nullptr) return;
    const double left = number(*view, "left");
    const double top = number(*view, "top");
    foreign.width_px = number(*view, "right") - left + 1.0;  // right and bottom are the last pixels
    foreign.height_px = number(*view, "bottom") - top + 1.0;
    read_lens(*intrinsic, foreign.lens);
    foreign.lens.cx_px -= left;
    foreign.lens.cy_px -= top;
    // The rows are the camera's axes in the world: right, up, and backwards from where it looks; ours is right, down,
    // forwards.
    Matrix3d rows;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rows(i, j) = number(*transform, fmt::format("r{}{}", i + 1, j + 1));
    }
    foreign.rotation = Vector3d(1.0, -1.0, -1.0).asDiagonal() * rows;
    const Vector3d centre(number(*transform, "x"), number(*transform, "y"), number(*transform, "z"));
    foreign.translation_m = -(foreign.rotation * (kM * centre));
    if (sound_) add_camera(foreign, rig, complaints_);
  }

 private:
  void read_lens(const XmlElement& intrinsic, Lens& lens) {
    lens.fx_px = number(intrinsic, "focalLengthU") / kUnits;
    lens.fy_px = number(intrinsic, "focalLengthV") / kUnits;
    lens.cx_px = number(intrinsic, "centerPointU") / kUnits;
    lens.cy_px = number(intrinsic, "centerPointV") / kUnits;
    lens.distortion << number(intrinsic, "radialDistortion1"), number(intrinsic, "radialDistortion2"),
        number(intrinsic, "tangentalDistortion1"), number(intrinsic, "tangentalDistortion2"),
        number(intrinsic, "radialDistortion3");
    const double skew = intrinsic.attribute("skew") != nullptr ? number(intrinsic, "skew") : 0.0;
    if (skew != 0.0) complain(intrinsic, fmt::format("skew is {}, expected 0: this rig has no skewed lenses", skew));
  }

  const XmlElement* part(std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (const XmlElement* found = camera_.child(name)) return found;
    }
    complain(camera_, fmt::format("has no <{}>", *names.begin()));
    return nullptr;
  }

  double number(const XmlElement& element, const std::string& key) {
    const std::string* word = element.attribute(key);
    if (word == nullptr) {
      complain(element, fmt::format("<{}> has no {}", element.name, key));
      return 0.0;
    }
    const auto value = number_of(*word);
    if (!value) complain(element, fmt::format("<{}> {} is '{}', expected a finite number", element.name, key, *word));
    return value.value_or(0.0);
  }

  void complain(const XmlElement& element, const std::string& what) {
    complaints_.add(element.at, fmt::format("camera '{}': {}", name_, what));
    sound_ = false;
  }

  const XmlElement& camera_;
  Complaints& complaints_;
  std::string name_;
  bool sound_ = true;
};

bool says(const XmlElement& camera, const char* key, const char* word) {
  const std::string* value = camera.attribute(key);
  return value != nullptr && *value == word;
}

}  // namespace

// Sources: the attributes' meaning as in the "camera calibration file" page of Theia's documentation and in QTM's
// real-time protocol; the axes and the unit as Pose2Sim reads them.
Result<ReadRig, settings::Faults> read_qca(const std::filesystem::path& path, const std::string& text) {
  const auto root = parse_xml(path, text);
  if (!root) return root.error();
  Complaints complaints(path);
  ReadRig read;
  const XmlElement* cameras = root->name == "calibration" ? root->child("cameras") : nullptr;
  if (cameras == nullptr) {
    complaints.add(root->at, "holds no <calibration> with <cameras>, expected a .qca.txt");
    return complaints.faults();
  }
  for (const XmlElement& element : cameras->children) {
    if (element.name != "camera") continue;
    QcaCamera camera(element, complaints);
    if (says(element, "active", "0") || says(element, "calibrated", "false")) {
      read.notices.push_back(
          fmt::format("camera '{}' is not active or not calibrated there and is left out", camera.name()));
      continue;
    }
    camera.add_to(read.rig);
  }
  if (read.rig.empty() && complaints.empty()) complaints.add(cameras->at, "holds no calibrated camera");
  if (!complaints.empty()) return complaints.faults();
  return read;
}

}  // namespace mocap::calibrate
