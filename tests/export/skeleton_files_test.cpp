#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <set>

#include "export/bone_names.h"
#include "export/bvh.h"
#include "export/euler_angles.h"
#include "export/fbx.h"
#include "export/fbx_node.h"
#include "export/fbx_scene.h"
#include "export/gltf.h"
#include "export/joint_motion.h"
#include "export/moving_clip.h"
#include "export/skinned_skeleton.h"
#include "export/usd.h"
#include "support/test_body.h"

namespace mocap::exports {
namespace skeleton_files_test {

Bone bone(const std::string& name, int parent, const BoneAliases& aliases) {
  Bone made;
  made.name = name;
  made.parent = parent;
  made.aliases = aliases;
  return made;
}

Skeleton arm() {
  return {"arm",
          {bone("UpArm", -1, {"LeftUpperArm", "upperarm_l", "leftUpperArm"}),
           bone("Index", 0, {"LeftIndexProximal", "index_01_l", "leftIndexProximal"}), bone("Sword", 0, {})}};
}

Clip one_of(const Clip& clip, std::size_t subject) {
  Clip alone = clip;
  alone.subjects = {clip.subjects[subject]};
  return alone;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

Eigen::Quaterniond product(const EulerOrder& order, const Eigen::Vector3d& angles) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < 3; ++i) {
    rotation =
        rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angles[static_cast<int>(i)], Eigen::Vector3d::Unit(order[i])));
  }
  return rotation;
}

TEST(BoneNames, FollowTheConventionAndKeepUnknownBones) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(bone_names(arm(), BoneNames::Skeleton), (Names{"UpArm", "Index", "Sword"}));
  EXPECT_EQ(bone_names(arm(), BoneNames::HumanBodyBones), (Names{"LeftUpperArm", "LeftIndexProximal", "Sword"}));
  EXPECT_EQ(bone_names(arm(), BoneNames::Mannequin), (Names{"upperarm_l", "index_01_l", "Sword"}));
  EXPECT_EQ(bone_names(arm(), BoneNames::Mixamo), (Names{"mixamorig:LeftArm", "mixamorig:LeftHandIndex1", "Sword"}));
  EXPECT_EQ(bone_names(arm(), BoneNames::HumanIk), (Names{"LeftArm", "LeftHandIndex1", "Sword"}));
}

TEST(BoneNames, AreFoundByTheNameOfTheConvention) {
  EXPECT_EQ(bone_names_called("mixamo"), BoneNames::Mixamo);
  EXPECT_EQ(bone_names_called("Mixamo"), std::nullopt);
}

TEST(BoneNames, AllDiffer) {
  EXPECT_EQ(made_unique({"a", "a_2", "a", "a"}), (std::vector<std::string>{"a", "a_2", "a_3", "a_4"}));
}

TEST(EulerAngles, GiveTheRotationBackInEveryOrder) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const EulerOrder& order : {kZxy, kZyx, EulerOrder{0, 1, 2}, EulerOrder{0, 2, 1}}) {
    for (int i = 0; i < 1000; ++i) {
      const Eigen::Quaterniond rotation =
          Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();

      const Eigen::Vector3d angles = euler_angles(rotation, order, Eigen::Vector3d::Zero());

      EXPECT_LT(mocap::test::angle_between(product(order, angles), rotation), 1e-7);
    }
  }
}

TEST(EulerAngles, KeepTheThirdAngleInGimbalLock) {
  constexpr double kQuarter = std::numbers::pi / 2.0;
  for (const EulerOrder& order : {kZxy, kZyx}) {
    for (const double second : {kQuarter, -kQuarter}) {
      const Eigen::Quaterniond rotation = product(order, {0.3, second, 0.4});

      const Eigen::Vector3d angles = euler_angles(rotation, order, {0.0, 0.0, 0.9});

      EXPECT_EQ(angles[2], 0.9);
      EXPECT_LT(mocap::test::angle_between(product(order, angles), rotation), 1e-6);
    }
  }
}

TEST(EulerAngles, HaveNoJumpsWhileABodyTurnsTwice) {
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int i = 0; i <= 400; ++i) {
    const Eigen::Vector3d truth{0.01 * std::numbers::pi * i, 0.2, -0.3};

    const Eigen::Vector3d angles = euler_angles(product(kZxy, truth), kZxy, before);

    EXPECT_LT((angles - truth).norm(), 1e-9);
    before = angles;
  }
}

TEST(SkinnedSkeleton, StandsOnTheFloorInTPoseAndFacesZ) {
  const SkinnedSkeleton skeleton = skinned_skeleton(test::moving_clip(), 0, BoneNames::Skeleton);

  double lowest_m = std::numeric_limits<double>::max();
  for (const SkinnedBone& its : skeleton.bones) {
    const Eigen::Vector3d end = its.bind_m + its.end_m.value_or(Eigen::Vector3d::Zero());
    lowest_m = std::min({lowest_m, its.bind_m.y(), end.y()});
    if (its.name == "LeftHand") {
      EXPECT_GT(its.bind_m.x(), 0.5);
    }
    if (its.name == "LeftFoot") {
      EXPECT_GT(its.end_m.value().z(), 0.1);
    }
  }
  EXPECT_NEAR(lowest_m, 0.0, 1e-12);
}

TEST(SkinnedSkeleton, HasAThinMeshAroundEveryBone) {
  const SkinnedSkeleton skeleton = skinned_skeleton(test::moving_clip(), 0, BoneNames::Skeleton);
  const StickMesh& mesh = skeleton.mesh;

  EXPECT_EQ(std::set<int>(mesh.bones.begin(), mesh.bones.end()).size(), skeleton.bones.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f normal = (mesh.points_m[b] - mesh.points_m[a]).cross(mesh.points_m[c] - mesh.points_m[a]);
    EXPECT_GT(normal.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]), 0.0F);
    EXPECT_EQ(mesh.bones[a], mesh.bones[b]);
    EXPECT_EQ(mesh.bones[a], mesh.bones[c]);
  }
  for (const Eigen::Vector3f& normal : mesh.normals) {
    EXPECT_NEAR(normal.norm(), 1.0F, 1e-6F);
  }
}

TEST(JointMotion, HoldsTheLastPoseOfALostBone) {
  const Clip clip = test::moving_clip();
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    const JointMotion motion(clip, s, skinned_skeleton(clip, s, BoneNames::Skeleton));
    const std::vector<Bone>& bones = clip.subjects[s].subject.marker_set.skeleton.bones;
    for (std::size_t f = 0; f < clip.frames; ++f) {
      for (std::size_t b = 0; b < bones.size(); ++b) {
        const Pose truth = test::sample_pose(clip, s, b, test::shown_frame(s, bones[b].name, f));
        EXPECT_LT((motion.parent_from_bone(f, b).position - to_y_up(truth.position)).norm(), 1e-12);
        EXPECT_LT(mocap::test::angle_between(motion.parent_from_bone(f, b).rotation, to_y_up(truth.rotation)), 1e-7);
      }
    }
  }
}

TEST(JointMotion, StaysInBindPoseWithoutAnyPose) {
  Clip clip = test::moving_clip();
  for (BoneSample& sample : clip.subjects[0].bones) {
    sample.state = BoneState::Lost;
  }
  const SkinnedSkeleton skeleton = skinned_skeleton(clip, 0, BoneNames::Skeleton);

  const JointMotion motion(clip, 0, skeleton);

  EXPECT_EQ(motion.parent_from_bone(3, 5).position, skeleton.bones[5].offset_m);
  EXPECT_FALSE(motion.translates(0));
}

TEST(Bvh, HasARootAtTheOriginAndPositionsOfTheRootAlone) {
  const std::string text = write_bvh(test::moving_clip(), 0, {});

  EXPECT_EQ(text.find("HIERARCHY\nROOT Hips\n{\n\tOFFSET 0.000000 0.000000 0.000000\n"
                      "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"),
            0U);
  EXPECT_EQ(count(text, "position"), 3U);
  EXPECT_EQ(count(text, "CHANNELS 3 "), 17U);
  EXPECT_EQ(count(text, "End Site"), 5U);
  EXPECT_NE(text.find("MOTION\nFrames: 45\nFrame Time: 0.033366666667\n"), std::string::npos);
}

TEST(Bvh, ScalesToTheUnit) {
  const Clip clip = test::moving_clip();

  EXPECT_NE(write_bvh(clip, 0, {}).find("OFFSET 0.000000 22.000000 -3.000000"), std::string::npos);
  EXPECT_NE(write_bvh(clip, 0, {.units_per_m = 1.0}).find("OFFSET 0.000000 0.220000 -0.030000"), std::string::npos);
}

TEST(FbxNode, StatesItsEndAndThatOfItsChildren) {
  FbxNode node("Ab");
  node.add(std::int32_t{7});
  node.field("C", "xyz");
  std::string file(100, '.');

  node.append_to(file);

  // Head 13, name 2, property 5; child: head 13, name 1, property 1 + 4 + 3; empty head 13.
  const std::string bytes = file.substr(100);
  ASSERT_EQ(bytes.size(), 13U + 2 + 5 + 22 + 13);
  std::uint32_t end = 0;
  std::memcpy(&end, bytes.data(), 4);
  EXPECT_EQ(end, 155U);
  std::memcpy(&end, bytes.data() + 20, 4);
  EXPECT_EQ(end, 142U);
  EXPECT_EQ(bytes.substr(12, 3), std::string("\2Ab"));
  EXPECT_EQ(bytes.substr(42), std::string(13, '\0'));
}

TEST(FbxNode, EndsTheFileWithAnAlignedFooter) {
  for (std::size_t length = 0; length < 20; ++length) {
    const std::vector<FbxNode> records{FbxNode(std::string(length, 'n'))};

    const std::string file = fbx_file(records);

    EXPECT_EQ((file.size() - 4 - 120 - 16) % 16, 0U);
    EXPECT_EQ(file.substr(0, 23), std::string("Kaydara FBX Binary  \0\x1a\0", 23));
  }
}

TEST(Fbx, NamesTheBonesOfOneSubjectWithoutNamespace) {
  const Clip clip = test::moving_clip();

  const std::string all = write_fbx(clip, BoneNames::Skeleton).value();
  const std::string alone = write_fbx(one_of(clip, 1), BoneNames::Skeleton).value();

  EXPECT_GT(count(all, "Ben Two:Hips"), 0U);
  EXPECT_EQ(count(alone, "Ben Two:Hips"), 0U);
  EXPECT_GT(count(alone, "Hips"), 0U);
  EXPECT_EQ(count(alone, "Null"), 0U);
}

TEST(Usd, MakesIdentifiersOfNames) {
  const std::string text = write_usd(test::moving_clip(), BoneNames::Skeleton);

  EXPECT_NE(text.find("def SkelRoot \"Ben_Two\""), std::string::npos);
  EXPECT_NE(text.find("def SkelRoot \"Anna_2\""), std::string::npos);
  EXPECT_NE(text.find("string take = \"walk \\\"one\\\"\""), std::string::npos);
  EXPECT_NE(text.find("timeCodesPerSecond = 29.97002997002997\n"), std::string::npos);
}

TEST(SkeletonFiles, AreTheSameForTheSameClip) {
  const Clip clip = test::moving_clip();

  EXPECT_EQ(write_bvh(clip, 1, {}), write_bvh(clip, 1, {}));
  EXPECT_EQ(write_gltf(clip, BoneNames::Mixamo).value(), write_gltf(clip, BoneNames::Mixamo).value());
  EXPECT_EQ(write_usd(clip, BoneNames::HumanIk), write_usd(clip, BoneNames::HumanIk));
  EXPECT_EQ(write_fbx(clip, BoneNames::Mannequin).value(), write_fbx(clip, BoneNames::Mannequin).value());
}

TEST(SkeletonFiles, HaveOneFrameIfTheClipHas) {
  Clip clip = one_of(test::moving_clip(), 2);
  clip.frames = 1;
  clip.subjects[0].bones.resize(1);

  EXPECT_NE(write_bvh(clip, 0, {}).find("Frames: 1\n"), std::string::npos);
  EXPECT_TRUE(write_gltf(clip, BoneNames::Skeleton).has_value());
  EXPECT_NE(write_usd(clip, BoneNames::Skeleton).find("endTimeCode = 0\n"), std::string::npos);
  EXPECT_TRUE(write_fbx(clip, BoneNames::Skeleton).has_value());
}

}  // namespace skeleton_files_test
}  // namespace mocap::exports
