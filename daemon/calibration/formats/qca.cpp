#include <fmt/format.h>

#include <cmath>

#include "calibration/formats/format_reader.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Lengths on the sensor are in 64ths of a pixel; the distortion coefficients are OpenCV's.
constexpr double kUnitsPerPixel = 64.0;
constexpr double kMetresPerMm = 1e-3;

class QcaCamera {
 public:
  QcaCamera(const XmlElement& camera, FaultCollector& faults) : camera_(camera), faults_(faults) {
    const std::string* serial = camera.attribute("serial");
    name_ = serial != nullptr ? *serial : std::string();
    if (name_.empty()) faults.add(camera.at, "<camera> has no serial, expected serial=\"name\"");
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
    // The rows are the camera axes in the world: right, up, backwards. Here: right, down, forwards.
    Matrix3d rows;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rows(i, j) = number(*transform, fmt::format("r{}{}", i + 1, j + 1));
    }
    foreign.rotation = Vector3d(1.0, -1.0, -1.0).asDiagonal() * rows;
    const Vector3d centre(number(*transform, "x"), number(*transform, "y"), number(*transform, "z"));
    foreign.translation_m = -(foreign.rotation * (kMetresPerMm * centre));
    if (is_valid_) add_camera(foreign, rig, faults_);
  }

 private:
  void read_lens(const XmlElement& intrinsic, Lens& lens) {
    lens.fx_px = number(intrinsic, "focalLengthU") / kUnitsPerPixel;
    lens.fy_px = number(intrinsic, "focalLengthV") / kUnitsPerPixel;
    lens.cx_px = number(intrinsic, "centerPointU") / kUnitsPerPixel;
    lens.cy_px = number(intrinsic, "centerPointV") / kUnitsPerPixel;
    lens.distortion << number(intrinsic, "radialDistortion1"), number(intrinsic, "radialDistortion2"),
        number(intrinsic, "tangentalDistortion1"), number(intrinsic, "tangentalDistortion2"),
        number(intrinsic, "radialDistortion3");
    const double skew = intrinsic.attribute("skew") != nullptr ? number(intrinsic, "skew") : 0.0;
    if (skew != 0.0) add_fault(intrinsic, fmt::format("skew is {}, expected 0", skew));
  }

  const XmlElement* part(std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (const XmlElement* found = camera_.child(name)) return found;
    }
    add_fault(camera_, fmt::format("has no <{}>", *names.begin()));
    return nullptr;
  }

  double number(const XmlElement& element, const std::string& key) {
    const std::string* word = element.attribute(key);
    if (word == nullptr) {
      add_fault(element, fmt::format("<{}> has no {}", element.name, key));
      return 0.0;
    }
    const auto value = number_of(*word);
    if (!value) add_fault(element, fmt::format("<{}> {} is '{}', expected a finite number", element.name, key, *word));
    return value.value_or(0.0);
  }

  void add_fault(const XmlElement& element, const std::string& what) {
    faults_.add(element.at, fmt::format("camera '{}': {}", name_, what));
    is_valid_ = false;
  }

  const XmlElement& camera_;
  FaultCollector& faults_;
  std::string name_;
  bool is_valid_ = true;
};

bool has_value(const XmlElement& camera, const char* key, const char* word) {
  const std::string* value = camera.attribute(key);
  return value != nullptr && *value == word;
}

}  // namespace

// Sources: the attributes from the page "camera calibration file" of Theia's documentation and from QTM's real-time
// protocol; axes and units as in Pose2Sim.
Result<ParsedRig, FormatFaults> parse_qca(const std::string& text) {
  const auto root = parse_xml(text);
  if (!root) return root.error();
  FaultCollector faults;
  ParsedRig read;
  const XmlElement* cameras = root->name == "calibration" ? root->child("cameras") : nullptr;
  if (cameras == nullptr) {
    faults.add(root->at, "has no <calibration> with <cameras>, expected a .qca.txt");
    return faults.faults();
  }
  for (const XmlElement& element : cameras->children) {
    if (element.name != "camera") continue;
    QcaCamera camera(element, faults);
    if (has_value(element, "active", "0") || has_value(element, "calibrated", "false")) {
      read.notices.push_back(
          fmt::format("camera '{}' is not active or not calibrated in this file and is left out", camera.name()));
      continue;
    }
    camera.add_to(read.rig);
  }
  if (read.rig.empty() && faults.empty()) faults.add(cameras->at, "has no calibrated camera");
  faults.check_plausibility(read.rig);
  if (!faults.empty()) return faults.faults();
  return read;
}

}  // namespace mocap::calibration
