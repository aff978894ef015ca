#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/formats/rig_format.h"

namespace mocap::calibration {

/// A place in a text, from 1; 0: unknown.
struct TextPlace {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// A node of a YAML document.
struct YamlValue {
  enum class Kind { Nothing, Word, List, Table };

  Kind kind = Kind::Nothing;
  std::string word;
  std::vector<YamlValue> list;
  std::vector<std::pair<std::string, YamlValue>> table;
  TextPlace at;

  /// The value of the first of these keys that the table has; null if it has none.
  const YamlValue* find(std::initializer_list<const char*> keys) const;
};

/// An XML element with its attributes and child elements; text between the tags is skipped.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<XmlElement> children;
  TextPlace at;

  const std::string* attribute(const std::string& key) const;
  const XmlElement* child(const std::string& key) const;
};

/// Collects the faults of one text.
class FaultCollector {
 public:
  void add(const TextPlace& at, std::string message);
  bool empty() const { return faults_.empty(); }
  const FormatFaults& faults() const { return faults_; }

  /// Notes the place of the next camera of the rig.
  void place_camera(const TextPlace& at) { cameras_.push_back(at); }
  /// Adds a fault for each implausible value of the rig, at the place of its camera. Only for a rig without other
  /// faults, whose cameras were all placed.
  void check_plausibility(const Rig& rig);

 private:
  FormatFaults faults_;
  std::vector<TextPlace> cameras_;
};

/// A camera as it stands in a text, before it is checked.
struct ForeignCamera {
  std::string name;
  TextPlace at;  ///< the place of its faults
  double width_px = 0.0;
  double height_px = 0.0;
  Lens lens;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< camera from world
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
};

/// Checks name, image size, focal lengths and rotation of a camera, collects the faults and appends the camera to
/// `rig`.
void add_camera(const ForeignCamera& camera, Rig& rig, FaultCollector& faults);

/// The finite number that a word represents.
std::optional<double> number_of(const std::string& word);

/// Parses YAML, including the first line of OpenCV's dialect. Fails if the document is no table, or deeper or larger
/// than a calibration can be (aliases can expand a small file to any size).
Result<YamlValue, FormatFaults> parse_yaml(const std::string& text);
/// Parses XML elements, attributes, comments and the five named entities; no text content, no DTD.
Result<XmlElement, FormatFaults> parse_xml(const std::string& text);

// The reader and the writer of each format.
Result<ParsedRig, FormatFaults> parse_opencv(const std::string& text, const std::string& default_name);
Result<ParsedRig, FormatFaults> parse_kalibr(const std::string& text);
Result<ParsedRig, FormatFaults> parse_qca(const std::string& text);
std::string opencv_text(const Rig& rig);
RigText kalibr_text(const Rig& rig);
std::string pose2sim_text(const Rig& rig);

}  // namespace mocap::calibration
