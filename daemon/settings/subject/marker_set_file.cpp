#include "settings/subject/marker_set_file.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/install_folders.h"
#include "identify/asymmetry.h"
#include "model/bounds.h"
#include "settings/shipped_files.h"
#include "settings/toml/suggestion.h"
#include "settings/toml/text_file.h"

namespace mocap::settings {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
// No bone of a person is longer than 2 m. A value in millimetres is larger.
constexpr double kLongestOffset_m = 2.0;

// A value in a message has at most so many bytes.
constexpr std::size_t kMostShown_bytes = 100;

// Cut between two characters of UTF-8.
std::string shortened(std::string text) {
  if (text.size() <= kMostShown_bytes) return text;
  std::size_t end = kMostShown_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

// Name of rotation_limits_deg in files of former releases.
constexpr std::string_view kFormerLimits = "turns_deg";

using Keys = std::initializer_list<std::string_view>;

// Collects the faults of one file while its values are read.
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  const std::string& file() const { return file_; }
  const std::vector<std::string>& faults() const { return faults_; }
  bool clean() const { return faults_.empty(); }
  void take(const std::vector<std::string>& more) { faults_.insert(faults_.end(), more.begin(), more.end()); }

  void fault(const toml::source_region& where, std::string_view what) {
    const bool known = static_cast<bool>(where.begin);
    faults_.push_back(
        fmt::format("{}:{}:{}: {}", file_, known ? where.begin.line : 1U, known ? where.begin.column : 1U, what));
  }

  void allow_only(const toml::table& table, std::string_view what, Keys keys) {
    for (const auto& [key, node] : table) {
      if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
      const std::vector<std::string> known(keys.begin(), keys.end());
      fault(key.source(), fmt::format("{}: unknown key '{}'{}", what, key.str(), did_you_mean(key.str(), known)));
    }
  }

  // The text of a key; empty if it is absent, which is a fault if it `must_be` there.
  std::string words(const toml::table& table, std::string_view what, std::string_view key, bool must_be) {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      if (must_be) fault(table.source(), fmt::format("{}: {} is missing, expected words in quotes", what, key));
      return {};
    }
    const auto value = node->value_exact<std::string>();
    if (!value || value->empty()) {
      fault(node->source(), fmt::format("{}: {} is {}, expected words in quotes", what, key, shown(*node)));
      return {};
    }
    return *value;
  }

  // `count` numbers from `least` to `most`; nothing if the key is absent or has a fault.
  template <std::size_t count>
  std::optional<std::array<double, count>> numbers(const toml::table& table, std::string_view what,
                                                   std::string_view key, double least, double most) {
    const toml::node* node = table.get(key);
    if (node == nullptr) return std::nullopt;
    std::array<double, count> values{};
    const toml::array* array = node->as_array();
    bool right = array != nullptr && array->size() == count;
    for (std::size_t i = 0; right && i < count; ++i) {
      const std::optional<double> value = array->get(i)->is_number() ? array->get(i)->value<double>() : std::nullopt;
      right = value && *value >= least && *value <= most;  // false for NaN, too
      if (right) values[i] = *value;
    }
    if (right) return values;
    fault(node->source(),
          fmt::format("{}: {} is {}, expected {} numbers from {} to {}", what, key, shown(*node), count, least, most));
    return std::nullopt;
  }

  static std::string shown(const toml::node& node) {
    std::ostringstream text;
    node.visit([&text](const auto& value) { text << value; });
    return shortened(text.str());
  }

 private:
  std::string file_;
  std::vector<std::string> faults_;
};

Error as_error(const Reader& reader) {
  std::string message;
  for (const std::string& fault : reader.faults()) message += fault + '\n';
  const std::size_t count = reader.faults().size();
  return {ErrorCode::InvalidArgument,
          message + fmt::format("{}: {} fault{}", reader.file(), count, count == 1 ? "" : "s")};
}

Result<toml::table> parse(const std::filesystem::path& file, Reader& reader) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return Error{ErrorCode::NotFound, fmt::format("{}: no such file", file.string())};
  }
  // A client may name the file: reading a pipe would wait for its writer.
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{ErrorCode::Io, fmt::format("{}: is a folder or a device, expected a TOML file", file.string())};
  }
  const Result<std::string, Fault> text = read_text(file);
  if (!text) return Error{ErrorCode::Io, fmt::format("{}: {}", file.string(), text.error().message)};
  try {
    return toml::parse(*text, file.string());
  } catch (const toml::parse_error& error) {
    reader.fault(error.source(), error.description());
    return as_error(reader);
  }
}

// The tables of an array; an element that is no table is a fault.
std::vector<const toml::table*> tables(const toml::table& root, std::string_view key, std::size_t most,
                                       Reader& reader) {
  std::vector<const toml::table*> found;
  const toml::node* node = root.get(key);
  const toml::array* array = node == nullptr ? nullptr : node->as_array();
  if (array == nullptr || array->empty() || array->size() > most) {
    reader.fault(node == nullptr ? root.source() : node->source(),
                 fmt::format("{} {}, expected 1 to {} tables [[{}]]", key,
                             node == nullptr    ? "is missing"
                             : array == nullptr ? "is no array"
                                                : fmt::format("has {}", array->size()),
                             most, key));
    return found;
  }
  for (const toml::node& item : *array) {
    if (const toml::table* table = item.as_table()) {
      found.push_back(table);
    } else {
      reader.fault(item.source(), fmt::format("{}: {} is no table", key, Reader::shown(item)));
    }
  }
  return found;
}

void read_rotation_limits(const toml::table& table, const std::string& what, Reader& reader, Bone& bone) {
  const toml::node* node = table.get("rotation_limits_deg");
  const toml::node* former = table.get(kFormerLimits);
  if (node != nullptr && former != nullptr) {
    reader.fault(former->source(), fmt::format("{}: {} is the former name of rotation_limits_deg, expected one of them",
                                               what, kFormerLimits));
  }
  if (node == nullptr) node = former;
  if (node == nullptr) return;
  const toml::table* limits = node->as_table();
  if (limits == nullptr) {
    reader.fault(node->source(), fmt::format("{}: rotation_limits_deg is {}, expected {{ x = [min, max], ... }}", what,
                                             Reader::shown(*node)));
    return;
  }
  reader.allow_only(*limits, what + ": rotation_limits_deg", {"x", "y", "z"});
  constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto range = reader.numbers<2>(*limits, what + ": rotation_limits_deg", kAxes[axis], -180.0, 180.0);
    if (!range) continue;
    if ((*range)[0] >= (*range)[1]) {
      reader.fault(limits->get(kAxes[axis])->source(),
                   fmt::format("{}: rotation_limits_deg {} is from {} to {}, expected the smaller first", what,
                               kAxes[axis], (*range)[0], (*range)[1]));
      continue;
    }
    bone.rotation_limits[axis] = AngleRange{(*range)[0] * kRadPerDegree, (*range)[1] * kRadPerDegree};
  }
}

void read_aliases(const toml::table& table, const std::string& what, Reader& reader, Bone& bone) {
  const toml::node* node = table.get("aliases");
  if (node == nullptr) return;
  const toml::table* aliases = node->as_table();
  if (aliases == nullptr) {
    reader.fault(node->source(),
                 fmt::format("{}: aliases is {}, expected {{ unity = \"...\", ... }}", what, Reader::shown(*node)));
    return;
  }
  reader.allow_only(*aliases, what + ": aliases", {"unity", "unreal", "vrm"});
  bone.aliases = {reader.words(*aliases, what, "unity", false), reader.words(*aliases, what, "unreal", false),
                  reader.words(*aliases, what, "vrm", false)};
}

int index_of(const std::vector<Bone>& bones, std::string_view name) {
  const auto found = std::find_if(bones.begin(), bones.end(), [&](const Bone& bone) { return bone.name == name; });
  return found == bones.end() ? -1 : static_cast<int>(found - bones.begin());
}

std::vector<std::string> names_of(const std::vector<Bone>& bones) {
  std::vector<std::string> names;
  for (const Bone& bone : bones) names.push_back(bone.name);
  return names;
}

void read_parent(const toml::table& table, const std::string& what, const Skeleton& above, Reader& reader, Bone& bone) {
  const toml::node* node = table.get("parent");
  if (node == nullptr) {
    if (!above.bones.empty()) {
      reader.fault(table.source(),
                   fmt::format("{}: parent is missing, expected an earlier bone; only the first bone has none", what));
    }
    return;
  }
  const std::string parent = reader.words(table, what, "parent", true);
  if (parent.empty()) return;
  bone.parent = index_of(above.bones, parent);
  if (bone.parent < 0) {
    reader.fault(node->source(), fmt::format("{}: parent is '{}', expected an earlier bone{}", what, parent,
                                             did_you_mean(parent, names_of(above.bones))));
  }
}

Skeleton read_skeleton(const toml::table& root, Reader& reader) {
  Skeleton skeleton;
  reader.allow_only(root, "skeleton", {"name", "bone"});
  skeleton.name = reader.words(root, "skeleton", "name", true);
  for (const toml::table* table : tables(root, "bone", kMaxBones, reader)) {
    Bone bone;
    bone.name = reader.words(*table, "bone", "name", true);
    const std::string what = fmt::format("bone '{}'", bone.name);
    reader.allow_only(*table, what,
                      {"name", "parent", "rest_offset_m", "rotation_limits_deg", kFormerLimits, "aliases"});
    if (!bone.name.empty() && index_of(skeleton.bones, bone.name) >= 0) {
      reader.fault(table->get("name")->source(),
                   fmt::format("{}: the name occurs twice, expected one bone per name", what));
    }
    read_parent(*table, what, skeleton, reader, bone);
    const auto offset = reader.numbers<3>(*table, what, "rest_offset_m", -kLongestOffset_m, kLongestOffset_m);
    if (offset) bone.rest_offset_m = {(*offset)[0], (*offset)[1], (*offset)[2]};
    if (table->get("rest_offset_m") == nullptr && table->get("parent") != nullptr) {
      reader.fault(
          table->source(),
          fmt::format("{}: rest_offset_m is missing, expected the offset of the joint from that of its parent, in m",
                      what));
    }
    read_rotation_limits(*table, what, reader, bone);
    read_aliases(*table, what, reader, bone);
    skeleton.bones.push_back(std::move(bone));
  }
  return skeleton;
}

void read_markers(const toml::table& root, Reader& reader, MarkerSet& set) {
  for (const toml::table* table : tables(root, "marker", kMaxLabels, reader)) {
    MarkerOnBone marker;
    marker.name = reader.words(*table, "marker", "name", true);
    const std::string what = fmt::format("marker '{}'", marker.name);
    reader.allow_only(*table, what, {"name", "bone", "offset_m", "colour"});
    const bool twice = std::any_of(set.markers.begin(), set.markers.end(),
                                   [&](const MarkerOnBone& other) { return other.name == marker.name; });
    if (twice && !marker.name.empty()) {
      reader.fault(table->get("name")->source(),
                   fmt::format("{}: the name occurs twice, expected one marker per name", what));
    }
    const std::string bone = reader.words(*table, what, "bone", true);
    marker.bone = index_of(set.skeleton.bones, bone);
    if (marker.bone < 0 && !bone.empty() && !set.skeleton.bones.empty()) {
      reader.fault(table->get("bone")->source(),
                   fmt::format("{}: bone is '{}', expected a bone of skeleton '{}'{}", what, bone, set.skeleton.name,
                               did_you_mean(bone, names_of(set.skeleton.bones))));
    }
    const auto offset = reader.numbers<3>(*table, what, "offset_m", -kLongestOffset_m, kLongestOffset_m);
    if (offset) marker.offset_m = {(*offset)[0], (*offset)[1], (*offset)[2]};
    const auto colour = reader.numbers<3>(*table, what, "colour", 0.0, 1.0);
    for (std::size_t i = 0; colour && i < 3; ++i) marker.colour[i] = static_cast<float>((*colour)[i]);
    set.markers.push_back(std::move(marker));
  }
}

// The two markers of a pair; anything else is a fault.
std::optional<MarkerPair> read_pair(const toml::node& node, const std::vector<MarkerOnBone>& markers, Reader& reader) {
  const toml::array* names = node.as_array();
  if (names == nullptr || names->size() != 2) {
    reader.fault(node.source(),
                 fmt::format("asymmetric: {} is no pair, expected [\"LThigh\", \"RThigh\"]", Reader::shown(node)));
    return std::nullopt;
  }
  std::vector<std::string> known;
  for (const MarkerOnBone& marker : markers) known.push_back(marker.name);
  std::array<std::size_t, 2> pair{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto name = names->get(i)->value_exact<std::string>();
    pair[i] = static_cast<std::size_t>(std::find(known.begin(), known.end(), name.value_or("")) - known.begin());
    if (name && pair[i] < known.size()) continue;
    reader.fault(names->get(i)->source(),
                 fmt::format("asymmetric: {} is no marker of this set{}", Reader::shown(*names->get(i)),
                             did_you_mean(name.value_or(""), known)));
    return std::nullopt;
  }
  return MarkerPair{pair[0], pair[1]};
}

// Needs all markers of the set. A pair that is listed as asymmetric must distinguish left from right.
void read_asymmetric(const toml::table& root, Reader& reader, MarkerSet& set) {
  const toml::node* node = root.get("asymmetric");
  if (node == nullptr) return;
  if (!node->is_array()) {
    reader.fault(node->source(),
                 fmt::format("asymmetric is {}, expected pairs [[\"LThigh\", \"RThigh\"], ...]", Reader::shown(*node)));
    return;
  }
  if (set.skeleton.bones.size() == 1 && !node->as_array()->empty()) {
    reader.fault(node->source(), "asymmetric: a rigid body has no left and right side, expected no pairs");
    return;
  }
  const std::vector<int> opposite = identify::opposite_bones(set.skeleton);
  for (const toml::node& item : *node->as_array()) {
    const std::optional<MarkerPair> pair = read_pair(item, set.markers, reader);
    if (!pair) continue;
    const MarkerOnBone &one = set.markers[pair->one], &other = set.markers[pair->other];
    const double off_m = identify::asymmetry_m(one.offset_m, other.offset_m).norm();
    if (pair->one == pair->other || opposite[static_cast<std::size_t>(one.bone)] != other.bone) {
      const auto name_of = [&](int bone) { return set.skeleton.bones[static_cast<std::size_t>(bone)].name; };
      reader.fault(item.source(),
                   fmt::format("asymmetric: '{}' is on {} and '{}' on {}, expected two markers of opposite bones",
                               one.name, name_of(one.bone), other.name, name_of(other.bone)));
    } else if (off_m < identify::kMinAsymmetry_m) {
      reader.fault(
          item.source(),
          fmt::format(
              "asymmetric: '{}' is {:.0f} mm off the mirror image of '{}' as seen from the front, expected {:.0f} mm "
              "or more; move one of them along its bone and measure its offset_m again, or leave the pair out",
              one.name, 1e3 * off_m, other.name, 1e3 * identify::kMinAsymmetry_m));
    } else {
      set.asymmetric.push_back(*pair);
    }
  }
}

}  // namespace

Result<Skeleton> load_skeleton(const std::filesystem::path& file) {
  Reader reader(file.string());
  const Result<toml::table> root = parse(file, reader);
  if (!root) return root.error();
  Skeleton skeleton = read_skeleton(*root, reader);
  if (!reader.clean()) return as_error(reader);
  return skeleton;
}

Result<MarkerSet> load_marker_set(const std::filesystem::path& file) {
  Reader reader(file.string());
  const Result<toml::table> root = parse(file, reader);
  if (!root) return root.error();
  MarkerSet set;
  reader.allow_only(*root, "marker set", {"name", "skeleton", "asymmetric", "marker"});
  set.name = reader.words(*root, "marker set", "name", true);

  const std::string named = reader.words(*root, "marker set", "skeleton", true);
  if (!named.empty()) {
    const FoundFile found = find_file(named, file.parent_path(), install_folders().data / "markersets");
    const std::filesystem::path& skeleton_file = found.path;
    Reader skeleton_reader(skeleton_file.string());
    const Result<toml::table> skeleton_root = parse(skeleton_file, skeleton_reader);
    if (skeleton_root) {
      set.skeleton = read_skeleton(*skeleton_root, skeleton_reader);
    } else if (skeleton_reader.clean()) {
      reader.fault(root->get("skeleton")->source(),
                   fmt::format("skeleton is '{}', expected a skeleton file: {}", named,
                               found.missing.empty() ? skeleton_root.error().message : found.missing));
    }
    reader.take(skeleton_reader.faults());
  }
  read_markers(*root, reader, set);
  if (reader.clean()) read_asymmetric(*root, reader, set);
  if (!reader.clean()) return as_error(reader);
  return set;
}

}  // namespace mocap::settings
