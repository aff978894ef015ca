#include "scene/import_marker_set.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <set>

#include "model/bounds.h"

namespace mocap::scene {
namespace {

struct Entry {
  std::string_view label;  // in upper case; a marker with a side has no L or R
  std::string_view bone;   // of human18, without Left or Right
  double x, y, z;          // offset of the left marker, m
};

// Markers with a side: "LASI", "RASI". The offsets are those of the shipped marker sets that have the marker.
constexpr std::array kSided{
    // Plug-in Gait
    Entry{"FHD", "Head", 0.095, 0.070, 0.100}, Entry{"BHD", "Head", -0.085, 0.070, 0.090},
    Entry{"BAK", "Chest", -0.100, 0.090, 0.130}, Entry{"BAC", "Chest", -0.100, 0.090, 0.130},
    Entry{"ASI", "Hips", 0.100, 0.120, 0.040}, Entry{"PSI", "Hips", -0.110, 0.050, 0.060},
    Entry{"SHO", "Collar", -0.030, 0.120, 0.090}, Entry{"UPA", "UpArm", -0.015, 0.120, 0.055},
    Entry{"ELB", "UpArm", -0.055, 0.280, 0.000}, Entry{"FRM", "LowArm", -0.010, 0.130, 0.045},
    Entry{"WRA", "LowArm", 0.055, 0.240, 0.020}, Entry{"WRB", "LowArm", -0.025, 0.240, 0.020},
    Entry{"FIN", "Hand", -0.005, 0.080, 0.025}, Entry{"THI", "UpLeg", 0.010, 0.080, -0.215},
    Entry{"KNE", "UpLeg", -0.010, 0.055, -0.420}, Entry{"TIB", "LowLeg", -0.010, 0.050, -0.210},
    Entry{"ANK", "LowLeg", -0.045, 0.045, -0.410}, Entry{"HEE", "Foot", -0.055, 0.000, -0.030},
    Entry{"TOE", "Foot", 0.165, 0.000, -0.025},
    // related to Plug-in Gait
    Entry{"FWT", "Hips", 0.100, 0.120, 0.040}, Entry{"BWT", "Hips", -0.110, 0.050, 0.060},
    Entry{"IAS", "Hips", 0.100, 0.120, 0.040}, Entry{"IPS", "Hips", -0.110, 0.050, 0.060},
    Entry{"WRI", "LowArm", 0.015, 0.245, 0.030}, Entry{"OFF", "Chest", -0.100, 0.090, 0.130},
    Entry{"SHN", "LowLeg", 0.040, 0.020, -0.190}, Entry{"SHA", "LowLeg", -0.010, 0.060, -0.210},
    Entry{"MT1", "Foot", 0.145, -0.045, -0.030}, Entry{"MT5", "Foot", 0.125, 0.050, -0.040},
    Entry{"FM1", "Foot", 0.145, -0.045, -0.030}, Entry{"FM5", "Foot", 0.125, 0.050, -0.040},
    Entry{"FCC", "Foot", -0.055, 0.000, -0.030}, Entry{"KNM", "UpLeg", -0.010, -0.055, -0.420},
    Entry{"MKN", "UpLeg", -0.010, -0.055, -0.420}, Entry{"ANM", "LowLeg", -0.035, -0.045, -0.405},
    Entry{"MMA", "LowLeg", -0.035, -0.045, -0.405}, Entry{"MED", "LowLeg", -0.035, -0.045, -0.405},
    Entry{"ELM", "UpArm", 0.030, 0.280, -0.030}, Entry{"GTR", "UpLeg", 0.000, 0.090, 0.000},
    Entry{"CAJ", "Collar", -0.030, 0.120, 0.090}, Entry{"HLE", "UpArm", -0.055, 0.280, 0.000},
    // Motive
    Entry{"SHOULDERTOP", "Collar", -0.035, 0.120, 0.090}, Entry{"SHOULDERBACK", "Collar", -0.110, 0.100, 0.000},
    Entry{"UARMHIGH", "UpArm", 0.000, 0.130, 0.060}, Entry{"ELBOWOUT", "UpArm", -0.055, 0.280, 0.000},
    Entry{"WRISTIN", "LowArm", 0.055, 0.230, 0.020}, Entry{"WRISTOUT", "LowArm", -0.025, 0.230, 0.020},
    Entry{"HANDOUT", "Hand", -0.025, 0.090, 0.025}, Entry{"HANDIN", "Hand", 0.040, 0.090, 0.025},
    Entry{"THIGH", "UpLeg", 0.040, 0.070, -0.220}, Entry{"KNEEOUT", "UpLeg", -0.010, 0.055, -0.420},
    Entry{"SHIN", "LowLeg", 0.040, 0.020, -0.190}, Entry{"ANKLEOUT", "LowLeg", -0.045, 0.045, -0.405},
    Entry{"HEEL", "Foot", -0.055, 0.000, -0.030}, Entry{"TOEOUT", "Foot", 0.125, 0.050, -0.040},
    Entry{"TOEIN", "Foot", 0.145, -0.045, -0.030}, Entry{"TOETIP", "Foot", 0.215, 0.000, -0.045},
    // Arena: name of the bone and a number
    Entry{"SHOULDER1", "Collar", -0.035, 0.120, 0.090}, Entry{"SHOULDER2", "Collar", -0.110, 0.110, 0.010},
    Entry{"UARM1", "UpArm", -0.055, 0.270, 0.000}, Entry{"UARM2", "UpArm", -0.040, 0.150, 0.050},
    Entry{"HAND1", "Hand", -0.020, 0.080, 0.025}, Entry{"HAND2", "Hand", 0.050, 0.000, 0.030},
    Entry{"HAND3", "Hand", -0.060, 0.000, 0.020}, Entry{"THIGH1", "UpLeg", 0.080, 0.030, -0.240},
    Entry{"THIGH2", "UpLeg", -0.010, 0.070, -0.420}, Entry{"SHIN1", "LowLeg", 0.020, 0.050, -0.220},
    Entry{"SHIN2", "LowLeg", -0.050, 0.050, -0.370}, Entry{"FOOT1", "Foot", 0.150, -0.040, -0.030},
    Entry{"FOOT2", "Foot", 0.110, 0.060, -0.035}};

constexpr std::array kCentral{
    Entry{"C7", "Chest", -0.070, 0.000, 0.280},         Entry{"T10", "Chest", -0.100, 0.000, 0.040},
    Entry{"T8", "Chest", -0.100, 0.000, 0.090},         Entry{"CLAV", "Chest", 0.090, 0.000, 0.220},
    Entry{"IJ", "Chest", 0.090, 0.000, 0.220},          Entry{"SJN", "Chest", 0.090, 0.000, 0.220},
    Entry{"STRN", "Chest", 0.130, 0.000, 0.070},        Entry{"PX", "Chest", 0.130, 0.000, 0.070},
    Entry{"SXS", "Chest", 0.130, 0.000, 0.070},         Entry{"SACR", "Hips", -0.120, 0.000, 0.060},
    Entry{"VSAC", "Hips", -0.120, 0.000, 0.060},        Entry{"L5", "Hips", -0.110, 0.000, 0.110},
    Entry{"HEADTOP", "Head", -0.005, 0.000, 0.180},     Entry{"HEADFRONT", "Head", 0.105, 0.000, 0.110},
    Entry{"HEADSIDE", "Head", 0.005, 0.085, 0.080},     Entry{"BACKTOP", "Chest", -0.060, 0.000, 0.280},
    Entry{"BACKLEFT", "Chest", -0.090, 0.100, 0.110},   Entry{"BACKRIGHT", "Chest", -0.090, -0.060, 0.040},
    Entry{"CHEST", "Chest", 0.130, 0.000, 0.110},       Entry{"WAISTLFRONT", "Hips", 0.100, 0.130, 0.040},
    Entry{"WAISTRFRONT", "Hips", 0.100, -0.130, 0.040}, Entry{"WAISTLBACK", "Hips", -0.100, 0.060, 0.060},
    Entry{"WAISTRBACK", "Hips", -0.100, -0.060, 0.060}, Entry{"HIP1", "Hips", 0.000, 0.170, 0.040},
    Entry{"HIP2", "Hips", 0.000, -0.160, 0.030},        Entry{"HIP3", "Hips", 0.120, 0.010, 0.040},
    Entry{"HIP4", "Hips", -0.120, -0.060, 0.050},       Entry{"CHEST1", "Chest", -0.100, 0.000, 0.200},
    Entry{"CHEST2", "Chest", -0.110, 0.070, 0.030},     Entry{"CHEST3", "Chest", -0.110, -0.060, 0.030},
    Entry{"HEAD1", "Head", -0.080, 0.000, 0.160},       Entry{"HEAD2", "Head", 0.100, 0.000, 0.130},
    Entry{"HEAD3", "Head", -0.060, -0.100, 0.060}};

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return result;
}

template <std::size_t count>
const Entry* find(const std::array<Entry, count>& entries, std::string_view label) {
  const auto found = std::ranges::find(entries, label, &Entry::label);
  return found == entries.end() ? nullptr : &*found;
}

// Rotation from the file's axes to z up: the identity, or the rotation of y to z if the markers are spread more along
// y.
Eigen::Matrix3d upright(const C3d& c3d, const std::vector<int>& points) {
  double spread_y = 0.0, spread_z = 0.0;
  for (std::size_t frame = 0; frame < c3d.frames; ++frame) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
    double count = 0.0;
    for (const int point : points) {
      if (point < 0 || !c3d.sample(frame, static_cast<std::size_t>(point)).there) continue;
      const Eigen::Vector3d& at = c3d.sample(frame, static_cast<std::size_t>(point)).position_m;
      sum += at;
      squares += at.cwiseAbs2();
      count += 1.0;
    }
    if (count < 2.0) continue;
    const Eigen::Vector3d variance = squares / count - (sum / count).cwiseAbs2();
    spread_y += variance.y();
    spread_z += variance.z();
  }
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  if (spread_y > spread_z) rotation << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
  return rotation;
}

}  // namespace

bool ever_there(const C3d& c3d, std::size_t point) {
  for (std::size_t frame = 0; frame < c3d.frames; ++frame) {
    if (c3d.sample(frame, point).there) return true;
  }
  return false;
}

std::string_view without_subject(std::string_view label) { return label.substr(label.rfind(':') + 1); }

std::optional<KnownMarker> known_marker(std::string_view label) {
  const std::string plain = upper(without_subject(label));
  // Arena labels start with the name of the subject and an underscore.
  for (std::string_view rest = plain;; rest = rest.substr(rest.find('_') + 1)) {
    if (const Entry* middle = find(kCentral, rest)) {
      return KnownMarker{std::string(middle->bone), {middle->x, middle->y, middle->z}};
    }
    if (rest.size() > 1 && (rest[0] == 'L' || rest[0] == 'R')) {
      if (const Entry* sided = find(kSided, rest.substr(1))) {
        const bool left = rest[0] == 'L';
        const bool whole = sided->bone == "Head" || sided->bone == "Chest" || sided->bone == "Hips";
        std::string bone = (whole ? "" : left ? "Left" : "Right") + std::string(sided->bone);
        return KnownMarker{std::move(bone), {sided->x, left ? sided->y : -sided->y, sided->z}};
      }
    }
    if (rest.find('_') == std::string_view::npos) return std::nullopt;
  }
}

Result<ImportedMarkerSet> import_marker_set(const C3d& c3d, const Skeleton& skeleton, const std::string& name) {
  ImportedMarkerSet imported;
  imported.marker_set.name = name;
  imported.marker_set.skeleton = skeleton;
  const auto kinds = kinds_of(c3d.labels);
  std::set<std::string, std::less<>> taken;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    imported.ghosts += kinds[i] == C3dPointKind::Ghost ? 1 : 0;
    imported.model_outputs += kinds[i] == C3dPointKind::ModelOutput ? 1 : 0;
    if (kinds[i] != C3dPointKind::Marker) continue;
    const std::string label(without_subject(c3d.labels[i]));
    const std::optional<KnownMarker> known = known_marker(label);
    const auto bone = known ? std::ranges::find(skeleton.bones, known->bone, &Bone::name) : skeleton.bones.end();
    if (bone == skeleton.bones.end()) {
      imported.unknown.push_back(c3d.labels[i]);
    } else if (!ever_there(c3d, i)) {
      ++imported.never_seen;
    } else if (!taken.insert(label).second) {
      imported.twice.push_back(c3d.labels[i]);
    } else if (imported.marker_set.markers.size() < kMaxLabels) {
      const std::array<float, 3> colour = known->bone.starts_with("Left")    ? std::array{0.3F, 0.8F, 1.0F}
                                          : known->bone.starts_with("Right") ? std::array{1.0F, 0.5F, 0.3F}
                                                                             : std::array{1.0F, 1.0F, 0.4F};
      imported.marker_set.markers.push_back(
          {label, static_cast<int>(bone - skeleton.bones.begin()), known->offset_m, colour});
    }
  }
  if (imported.marker_set.markers.size() < 4) {
    return Error{
        ErrorCode::InvalidArgument,
        "C3D: " + std::to_string(imported.marker_set.markers.size()) +
            " labels follow a known convention (Plug-in Gait, Motive or Arena), expected at least 4; 'mocapctl "
            "subject import --by-motion' finds bones in the motion, whatever the labels are"};
  }
  return imported;
}

bodyfit::LabelledTake take_of(const C3d& c3d, const MarkerSet& set) {
  std::vector<int> points;
  for (const MarkerOnBone& marker : set.markers) {
    int point = -1;
    for (std::size_t i = 0; i < c3d.labels.size() && point < 0; ++i) {
      if (without_subject(c3d.labels[i]) == marker.name) point = static_cast<int>(i);
    }
    points.push_back(point);
  }
  const Eigen::Matrix3d world_from_file = upright(c3d, points);
  bodyfit::LabelledTake take{set.markers.size(), {}};
  take.places_m.reserve(c3d.frames * points.size());
  for (std::size_t frame = 0; frame < c3d.frames; ++frame) {
    for (const int point : points) {
      const C3dSample* sample = point < 0 ? nullptr : &c3d.sample(frame, static_cast<std::size_t>(point));
      const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
      take.places_m.push_back(sample != nullptr && sample->there ? Eigen::Vector3d(world_from_file * sample->position_m)
                                                                 : nowhere);
    }
  }
  return take;
}

}  // namespace mocap::scene
