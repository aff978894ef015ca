#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibrate/formats_rig.h"

namespace mocap::calibrate {

/// Where something stands in a file, from 1.
struct Place {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// What a YAML file says: a word, a list or a table, and where.
struct YamlValue {
  enum class Kind { Nothing, Word, List, Table };

  Kind kind = Kind::Nothing;
  std::string word;
  std::vector<YamlValue> list;
  std::vector<std::pair<std::string, YamlValue>> table;
  Place at;

  /// The value of the first of these keys that is there; null where none is.
  const YamlValue* find(std::initializer_list<const char*> keys) const;
};

/// An XML element: what stands between its tags as elements; text is left out.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<XmlElement> children;
  Place at;

  const std::string* attribute(const std::string& key) const;
  const XmlElement* child(const std::string& key) const;
};

/// Gathers what is wrong with one file.
class Complaints {
 public:
  explicit Complaints(const std::filesystem::path& path) { faults_.file = path; }

  void add(const Place& at, std::string message);
  bool empty() const { return faults_.list.empty(); }
  const settings::Faults& faults() const { return faults_; }

 private:
  settings::Faults faults_;
};

/// A camera as another program has it: checked, then made ours.
struct ForeignCamera {
  std::string name;
  Place at;  ///< where a fault of it is shown
  double width_px = 0.0;
  double height_px = 0.0;
  Lens lens;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< camera from world
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
};

/// Adds the camera to the rig where it can be one; complains of image size, focal length and what is no rotation.
void add_camera(const ForeignCamera& camera, Rig& rig, Complaints& complaints);

/// A word as a finite number; nothing where it is none.
std::optional<double> number_of(const std::string& word);

/// OpenCV's dialect, too.
Result<YamlValue, settings::Faults> parse_yaml(const std::filesystem::path& path, const std::string& text);
/// Enough of XML for files of numbers: elements, attributes, comments, the five named entities; no text, no DTD.
Result<XmlElement, settings::Faults> parse_xml(const std::filesystem::path& path, const std::string& text);

// Each format's own reader and writer.
Result<ReadRig, settings::Faults> read_opencv(const std::filesystem::path& path, const std::string& text);
Result<ReadRig, settings::Faults> read_kalibr(const std::filesystem::path& path, const std::string& text);
Result<ReadRig, settings::Faults> read_qca(const std::filesystem::path& path, const std::string& text);
std::string opencv_text(const Rig& rig);
RigText kalibr_text(const Rig& rig);
std::string pose2sim_text(const Rig& rig);

}  // namespace mocap::calibrate
