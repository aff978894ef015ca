// Writes moving_clip() in all formats of skeletons and as a take, and the poses and markers that a reader must find,
// for readers_test.py.
//
// usage: export_samples FOLDER

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "export/bvh.h"
#include "export/fbx.h"
#include "export/gltf.h"
#include "export/moving_clip.h"
#include "export/recorded_clip.h"
#include "export/usd.h"

namespace {

using namespace mocap;
using Json = nlohmann::json;

Json numbers(const Pose& pose) {
  const Eigen::Vector4d q = pose.rotation.coeffs();
  return {pose.position.x(), pose.position.y(), pose.position.z(), q[0], q[1], q[2], q[3]};
}

// World poses of all bones in one frame, in the axes of the feed.
Json poses(const exports::Clip& clip, std::size_t subject, std::size_t frame) {
  const std::vector<Bone>& bones = clip.subjects[subject].subject.marker_set.skeleton.bones;
  std::vector<Pose> world;
  Json found = Json::array();
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const std::size_t shown = exports::test::shown_frame(subject, bones[b].name, frame);
    const Pose local = exports::test::sample_pose(clip, subject, b, shown);
    world.push_back(bones[b].parent < 0 ? local : world[static_cast<std::size_t>(bones[b].parent)] * local);
    found.push_back(numbers(world.back()));
  }
  return found;
}

// Positions of all markers in one frame; null if lost.
Json positions(const exports::ClipSubject& subject, std::size_t frame) {
  const std::vector<Pose> world = exports::test::world_poses(subject, frame);
  Json found = Json::array();
  for (const MarkerOnBone& marker : subject.subject.marker_set.markers) {
    const Eigen::Vector3d at = world[static_cast<std::size_t>(marker.bone)] * marker.offset_m;
    found.push_back(at.allFinite() ? Json{at.x(), at.y(), at.z()} : Json());
  }
  return found;
}

Json truth(const exports::Clip& clip) {
  Json subjects = Json::array();
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    Json names = Json::array();
    Json parents = Json::array();
    Json rest = Json::array();
    for (const Bone& bone : clip.subjects[s].subject.marker_set.skeleton.bones) {
      names.push_back(bone.name);
      parents.push_back(bone.parent);
      rest.push_back({bone.rest_offset_m.x(), bone.rest_offset_m.y(), bone.rest_offset_m.z()});
    }
    Json markers = Json::array();
    for (const MarkerOnBone& marker : clip.subjects[s].subject.marker_set.markers) {
      markers.push_back({marker.bone, marker.offset_m.x(), marker.offset_m.y(), marker.offset_m.z()});
    }
    Json frames = Json::array(), marker_frames = Json::array();
    for (std::size_t f = 0; f < clip.frames; ++f) {
      frames.push_back(poses(clip, s, f));
      marker_frames.push_back(positions(clip.subjects[s], f));
    }
    subjects.push_back({{"bones", names},
                        {"parents", parents},
                        {"rest_offsets_m", rest},
                        {"markers", markers},
                        {"frames", frames},
                        {"marker_frames", marker_frames}});
  }
  return {{"rate", {clip.rate.numerator, clip.rate.denominator}}, {"subjects", subjects}};
}

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    return 64;
  }
  const std::filesystem::path folder = arguments[1];
  const exports::Clip clip = exports::test::moving_clip();
  const auto names = exports::BoneNames::Skeleton;
  write(folder / "truth.json", truth(clip).dump());
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    write(folder / ("subject" + std::to_string(s) + ".bvh"), exports::write_bvh(clip, s, {}));
  }
  exports::test::record(clip, {"Anna", "Ben", "Prop"}, folder / "take.mcap");
  exports::Clip first_subject = clip;
  first_subject.subjects.resize(1);
  for (const auto& [name, of] : {std::pair{"clip", clip}, std::pair{"one", first_subject}}) {
    const std::string path = (folder / name).string();
    write(path + ".glb", exports::write_gltf(of, names).value());
    write(path + ".usda", exports::write_usd(of, names));
    write(path + ".fbx", exports::write_fbx(of, names).value());
  }
  return 0;
}
