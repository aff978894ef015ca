#include "settings/subject/subject_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>
#include <system_error>

#include "base/replace_file.h"
#include "settings/rig/rig_text.h"
#include "settings/subject/marker_set_file.h"
#include "settings/toml/suggestion.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 1;
// No bone of a person is longer than 2 m. A value in millimetres is larger.
constexpr KeyRange kOffset_m{-2.0, 2.0};
constexpr KeyRange kResidual_m{0.0, 1.0};
constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;

std::string offset_text(const Eigen::Vector3d& v) { return list_text({v.x(), v.y(), v.z()}); }

// `path` relative to the folder of `file`.
std::string relative_to(const fs::path& file, const fs::path& path) {
  std::error_code ignored;
  const fs::path folder = fs::absolute(file, ignored).parent_path();
  const fs::path relative = fs::proximate(fs::absolute(path, ignored), folder, ignored);
  return (relative.empty() ? path : relative).generic_string();
}

std::string residual_text(const std::vector<double>& residuals, std::size_t i) {
  return i < residuals.size() && residuals[i] > 0.0 ? fmt::format(", residual_m = {}", number_text(residuals[i])) : "";
}

// Reads the offsets of bones or markers by name: each name of the marker set once, and no other name.
class OffsetReader {
 public:
  OffsetReader(std::string what, std::string key, std::vector<std::string> names)
      : what_(std::move(what)), key_(std::move(key)), names_(std::move(names)), found_(names_.size()) {
    residuals_m.resize(names_.size());
    offsets_m.resize(names_.size());
  }

  void read(TomlTable& table) {
    std::string name;
    table.text("name", name);
    if (!table.require("name", fmt::format("the name of a {}", what_))) return;
    table.call(fmt::format("{} '{}'", what_, name));
    const auto at = std::ranges::find(names_, name);
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    double residual_m = 0.0;
    if (table.require(key_, "[x, y, z] in m")) table.numbers(key_, {offset.data(), 3}, kOffset_m);
    table.number("residual_m", residual_m, kResidual_m);
    table.done();
    if (at == names_.end()) {
      return table.fault("name", fmt::format("is not in the marker set{}", did_you_mean(name, names_)));
    }
    const auto i = static_cast<std::size_t>(at - names_.begin());
    if (found_[i]) return table.fault("name", fmt::format("is there twice, expected each {} once", what_));
    found_[i] = true;
    offsets_m[i] = offset;
    residuals_m[i] = residual_m;
  }

  void finish(TomlTable& root) const {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!found_[i])
        root.fault(what_, fmt::format("{} '{}' is missing, expected all of the marker set", what_, names_[i]));
    }
  }

  std::vector<Eigen::Vector3d> offsets_m;
  std::vector<double> residuals_m;

 private:
  std::string what_, key_;
  std::vector<std::string> names_;
  std::vector<bool> found_;
};

void read_offsets(TomlTable& root, SubjectFile& subject) {
  std::vector<std::string> bones, markers;
  // The root has no offset.
  for (std::size_t b = 1; b < subject.marker_set.skeleton.bones.size(); ++b) {
    bones.push_back(subject.marker_set.skeleton.bones[b].name);
  }
  for (const MarkerOnBone& marker : subject.marker_set.markers) markers.push_back(marker.name);
  OffsetReader of_bones("bone", "rest_offset_m", bones), of_markers("marker", "offset_m", markers);
  for (TomlTable& table : root.tables("bone", "bone")) of_bones.read(table);
  for (TomlTable& table : root.tables("marker", "marker")) of_markers.read(table);
  of_bones.finish(root);
  of_markers.finish(root);
  subject.bone_residuals_m.assign(1, 0.0);
  for (std::size_t b = 0; b < bones.size(); ++b) {
    subject.marker_set.skeleton.bones[b + 1].rest_offset_m = of_bones.offsets_m[b];
    subject.bone_residuals_m.push_back(of_bones.residuals_m[b]);
  }
  for (std::size_t m = 0; m < markers.size(); ++m) subject.marker_set.markers[m].offset_m = of_markers.offsets_m[m];
  subject.marker_residuals_m = of_markers.residuals_m;
}

}  // namespace

Result<SubjectFile, Faults> load_subject(const fs::path& path) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  TomlTable root = file->root();
  SubjectFile subject;
  int format = kFormat;
  if (root.require("format", fmt::format("the number {}", kFormat))) root.number("format", format, {kFormat, kFormat});
  root.text("name", subject.name);
  if (root.require("name", "the subject's name") && subject.name.empty())
    root.fault("name", "name is '', expected one");
  root.text("fitted_on", subject.fitted_on);
  root.number("size", subject.size, {0.1, 10.0});
  root.number("residual_m", subject.residual_m, kResidual_m);
  root.path("marker_set", subject.marker_set_file);
  if (root.require("marker_set", "the marker set of the subject")) {
    const FoundFile found = root.shipped_file("marker_set");
    if (found.missing.empty()) subject.marker_set_file = found.path;
    Result<MarkerSet> set = found.missing.empty() ? load_marker_set(subject.marker_set_file)
                                                  : Result<MarkerSet>(Error{ErrorCode::NotFound, found.missing});
    if (set) {
      subject.marker_set = *std::move(set);
      read_offsets(root, subject);
    } else {
      root.ignore("bone");
      root.ignore("marker");
      root.fault("marker_set", fmt::format("marker_set cannot be used: {}", set.error().message));
    }
  }
  root.done();
  if (!file->faults().list.empty()) return file->faults();
  return subject;
}

Status save_subject(const fs::path& path, const SubjectFile& subject) {
  const auto& bones = subject.marker_set.skeleton.bones;
  std::string text = "# A fitted body: offsets of its joints and its markers. Written by mocapd or mocapctl.\n\n";
  text += fmt::format("format = {}\n", kFormat);
  text += fmt::format("name = {}\n", quoted_text(subject.name));
  text += fmt::format("marker_set = {}  # path relative to this file\n",
                      quoted_text(relative_to(path, subject.marker_set_file)));
  text += fmt::format("fitted_on = {}\n", quoted_text(subject.fitted_on));
  text += fmt::format("size = {}  # of the body relative to the marker set\n", number_text(subject.size));
  text +=
      fmt::format("residual_m = {}  # rms distance of the markers from the body\n\n", number_text(subject.residual_m));
  text += "# rest_offset_m: the joint from the joint of its parent, in rest pose\nbone = [\n";
  for (std::size_t b = 1; b < bones.size(); ++b) {
    text += fmt::format("  {{ name = {}, rest_offset_m = {}{} }},\n", quoted_text(bones[b].name),
                        offset_text(bones[b].rest_offset_m), residual_text(subject.bone_residuals_m, b));
  }
  text += "]\n\n# offset_m: from the bone's joint, in the bone's frame\nmarker = [\n";
  for (std::size_t m = 0; m < subject.marker_set.markers.size(); ++m) {
    const MarkerOnBone& marker = subject.marker_set.markers[m];
    text += fmt::format("  {{ name = {}, offset_m = {}{} }},\n", quoted_text(marker.name), offset_text(marker.offset_m),
                        residual_text(subject.marker_residuals_m, m));
  }
  return replace_file(path, text + "]\n");
}

Status save_marker_set(const fs::path& path, const MarkerSet& set, const fs::path& skeleton_file) {
  std::string text = fmt::format("name = {}\nskeleton = {}  # path relative to this file\n\n", quoted_text(set.name),
                                 quoted_text(relative_to(path, skeleton_file)));
  std::string pairs;
  for (const auto& [one, other] : set.asymmetric) {
    pairs += fmt::format("{}[{}, {}]", pairs.empty() ? "" : ", ", quoted_text(set.markers[one].name),
                         quoted_text(set.markers[other].name));
  }
  text += fmt::format(
      "# pairs that are no mirror images of each other seen from the front: they distinguish left from "
      "right\nasymmetric = "
      "[{}]\n\n",
      pairs);
  text += "# offset_m: from the bone's joint, in the bone's frame; colour: red, green, blue, 0 to 1\nmarker = [\n";
  for (const MarkerOnBone& marker : set.markers) {
    const std::string& bone = set.skeleton.bones[static_cast<std::size_t>(marker.bone)].name;
    text += fmt::format("  {{ name = {}, bone = {}, offset_m = {}, colour = [{:.3g}, {:.3g}, {:.3g}] }},\n",
                        quoted_text(marker.name), quoted_text(bone), offset_text(marker.offset_m), marker.colour[0],
                        marker.colour[1], marker.colour[2]);
  }
  return replace_file(path, text + "]\n");
}

Status save_skeleton(const fs::path& path, const Skeleton& skeleton) {
  std::string text = fmt::format(
      "# rest_offset_m: the joint from the joint of its parent, in rest pose\n"
      "# rotation_limits_deg: range of rotation about x, y, z\n"
      "name = {}\n",
      quoted_text(skeleton.name));
  for (const Bone& bone : skeleton.bones) {
    text += fmt::format("\n[[bone]]\nname = {}\n", quoted_text(bone.name));
    if (bone.parent >= 0) {
      text += fmt::format("parent = {}\nrest_offset_m = {}\n",
                          quoted_text(skeleton.bones[static_cast<std::size_t>(bone.parent)].name),
                          offset_text(bone.rest_offset_m));
    }
    std::string limits;
    for (std::size_t axis = 0; axis < bone.rotation_limits.size(); ++axis) {
      if (!bone.rotation_limits[axis]) continue;
      limits += fmt::format("{}{} = [{:.1f}, {:.1f}]", limits.empty() ? "" : ", ", "xyz"[axis],
                            kDegreesPerRad * bone.rotation_limits[axis]->min_rad,
                            kDegreesPerRad * bone.rotation_limits[axis]->max_rad);
    }
    text += fmt::format("rotation_limits_deg = {{ {} }}\n", limits);
  }
  return replace_file(path, text);
}

}  // namespace mocap::settings
