#include "support/test_body.h"

#include <toml++/toml.h>

#include <algorithm>

#include "kinematics/rotation.h"
#include "support/places.h"

namespace mocap::test {

MarkerSet person(const std::string& name) {
  const std::string folder = support::source_folder() + "/config/";
  const toml::table markers = toml::parse_file(folder + "markersets/" + name + ".toml");
  const toml::table skeleton =
      toml::parse_file(folder + "markersets/" + markers["skeleton"].value<std::string>().value());
  const auto three = [](const toml::node_view<const toml::node>& v) {
    return Eigen::Vector3d(v[0].value_or(0.0), v[1].value_or(0.0), v[2].value_or(0.0));
  };
  const auto bone_named = [](const MarkerSet& set, const std::string& bone) {
    for (std::size_t i = 0; i < set.skeleton.bones.size(); ++i) {
      if (set.skeleton.bones[i].name == bone) return static_cast<int>(i);
    }
    return -1;
  };
  MarkerSet set;
  set.name = name;
  for (const toml::node& node : *skeleton["bone"].as_array()) {
    const toml::node_view<const toml::node> view(node);
    Bone bone;
    bone.name = view["name"].value_or(std::string());
    bone.parent = bone_named(set, view["parent"].value_or(std::string()));
    bone.rest_offset_m = three(view["rest_offset_m"]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto range = view["rotation_limits_deg"][std::string(1, static_cast<char>('x' + axis))];
      if (!range.is_array()) continue;  // a locked axis
      bone.rotation_limits[axis] =
          AngleRange{range[0].value_or(0.0) * 0.0174532925, range[1].value_or(0.0) * 0.0174532925};
    }
    set.skeleton.bones.push_back(bone);
  }
  for (const toml::node& node : *markers["marker"].as_array()) {
    const toml::node_view<const toml::node> view(node);
    set.markers.push_back({view["name"].value_or(std::string()),
                           bone_named(set, view["bone"].value_or(std::string())),
                           three(view["offset_m"]),
                           {}});
  }
  const auto marker_named = [&set](const std::string& marker) {
    return static_cast<std::size_t>(std::ranges::find(set.markers, marker, &MarkerOnBone::name) - set.markers.begin());
  };
  if (const toml::array* pairs = markers["asymmetric"].as_array()) {
    for (const toml::node& node : *pairs) {
      const toml::node_view<const toml::node> view(node);
      set.asymmetric.push_back(
          {marker_named(view[0].value_or(std::string())), marker_named(view[1].value_or(std::string()))});
    }
  }
  return set;
}

MarkerSet sparse_person(double apart_m) {
  MarkerSet set = person("baseline41");
  set.asymmetric.clear();
  const auto kept = [](const MarkerOnBone& marker) {
    const std::string part = marker.name.substr(1);
    const bool on_limb = part == "ShoulderTop" || part == "UArmHigh" || part == "ElbowOut" || part == "WristOut" ||
                         part == "Thigh" || part == "KneeOut" || part == "Shin" || part == "AnkleOut";
    return on_limb || marker.name == "HeadTop" || marker.name == "BackTop";
  };
  std::erase_if(set.markers, [&](const MarkerOnBone& marker) { return !kept(marker); });
  for (MarkerOnBone& marker : set.markers) {
    const double side = marker.name[0] == 'L' ? 1.0 : -1.0;
    if (marker.name.ends_with("Thigh")) marker.offset_m.z() = -0.22 + 0.5 * side * apart_m;
    if (marker.name.ends_with("Shin")) marker.offset_m.z() = -0.19 + 0.5 * side * apart_m;
    if (marker.name.ends_with("UArmHigh")) marker.offset_m.y() = side * 0.13 - 0.5 * apart_m;
  }
  return set;
}

std::size_t bone_named(const MarkerSet& set, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(set.skeleton.bones, name, &Bone::name) -
                                  set.skeleton.bones.begin());
}

std::size_t marker_named(const MarkerSet& set, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(set.markers, name, &MarkerOnBone::name) - set.markers.begin());
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return kinematics::rotation_vector(a * b.conjugate()).norm();
}

std::vector<Pose> random_pose(const MarkerSet& set, double spread_rad, std::mt19937& random) {
  std::vector<Pose> locals;
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  for (const Bone& bone : set.skeleton.bones) {
    Pose pose{bone.rest_offset_m, Eigen::Quaterniond::Identity()};
    Eigen::Vector3d phi;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange range = bone.rotation_limits[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
      const double x = share(random);
      phi[axis] = x * std::min(spread_rad, 0.5 * (x < 0.0 ? -range.min_rad : range.max_rad));
    }
    if (bone.parent < 0) {
      pose.position = {share(random), share(random), 1.0};
      phi = Eigen::Vector3d(0.2 * share(random), 0.2 * share(random), 3.1 * share(random));
    }
    pose.rotation = kinematics::from_rotation_vector(phi);
    locals.push_back(pose);
  }
  return locals;
}

std::vector<kinematics::Observation> see(const kinematics::PoseFit& truth) {
  std::vector<kinematics::Observation> seen;
  for (std::size_t m = 0; m < truth.marker_set().markers.size(); ++m) {
    seen.push_back({static_cast<int>(m), truth.marker_at(m), 0.005});
  }
  return seen;
}

std::vector<kinematics::Observation> without(std::vector<kinematics::Observation> seen, std::size_t marker) {
  std::erase_if(seen,
                [&](const kinematics::Observation& one) { return static_cast<std::size_t>(one.marker) == marker; });
  return seen;
}

}  // namespace mocap::test
