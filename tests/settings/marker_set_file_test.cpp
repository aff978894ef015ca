#include "settings/subject/marker_set_file.h"
#include "support/places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "settings/subject/subject_file.h"

namespace mocap::settings {
namespace marker_set_file_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kMarkerSets = fs::path(support::source_folder()) / "config" / "markersets";

// Each test has a folder of its own, which is removed afterwards.
class MarkerSetFile : public ::testing::Test {
 protected:
  MarkerSetFile() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("marker_set_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~MarkerSetFile() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  fs::path folder_;
};

constexpr const char* kTwoBones = R"(name = "two"
[[bone]]
name = "Hips"
[[bone]]
name = "Chest"
parent = "Hips"
rest_offset_m = [0.0, 0.0, 0.25]
rotation_limits_deg = { x = [-30, 30], y = [-90, 0] }
aliases = { unity = "Spine" }
)";

TEST(ShippedMarkerSets, LoadWithTheirNumberOfMarkers) {
  for (const auto& [name, count] : {std::pair{"openmocap18", 18U},
                                    {"baseline41", 41U},
                                    {"pluginGait39", 39U},
                                    {"baseline47", 47U},
                                    {"baseline51", 51U},
                                    {"baseline61", 61U},
                                    {"rigid3", 3U},
                                    {"rigid4", 4U},
                                    {"rigid5", 5U}}) {
    const auto set = load_marker_set(kMarkerSets / (std::string(name) + ".toml"));

    ASSERT_TRUE(set) << set.error().message;
    EXPECT_EQ(set->name, name);
    EXPECT_EQ(set->markers.size(), count);
    std::set<std::string> names;
    for (const MarkerOnBone& marker : set->markers) names.insert(marker.name);
    EXPECT_EQ(names.size(), count);
  }
}

// The names of the bones of our skeletons in Unity's HumanBodyBones, Unreal's Mannequin and VRM 1.0's humanoid.
const std::set<std::string> kUnity{"Hips",
                                   "Spine",
                                   "Chest",
                                   "UpperChest",
                                   "Neck",
                                   "Head",
                                   "LeftShoulder",
                                   "RightShoulder",
                                   "LeftUpperArm",
                                   "RightUpperArm",
                                   "LeftLowerArm",
                                   "RightLowerArm",
                                   "LeftHand",
                                   "RightHand",
                                   "LeftUpperLeg",
                                   "RightUpperLeg",
                                   "LeftLowerLeg",
                                   "RightLowerLeg",
                                   "LeftFoot",
                                   "RightFoot",
                                   "LeftToes",
                                   "RightToes",
                                   "LeftThumbProximal",
                                   "RightThumbProximal",
                                   "LeftIndexProximal",
                                   "RightIndexProximal",
                                   "LeftMiddleProximal",
                                   "RightMiddleProximal",
                                   "LeftRingProximal",
                                   "RightRingProximal",
                                   "LeftLittleProximal",
                                   "RightLittleProximal",
                                   "LeftThumbIntermediate",
                                   "RightThumbIntermediate",
                                   "LeftIndexIntermediate",
                                   "RightIndexIntermediate",
                                   "LeftMiddleIntermediate",
                                   "RightMiddleIntermediate",
                                   "LeftRingIntermediate",
                                   "RightRingIntermediate",
                                   "LeftLittleIntermediate",
                                   "RightLittleIntermediate"};
const std::set<std::string> kUnreal{
    "root",       "pelvis",     "spine_01",   "spine_02",    "spine_03",    "neck_01",     "head",        "clavicle_l",
    "clavicle_r", "upperarm_l", "upperarm_r", "lowerarm_l",  "lowerarm_r",  "hand_l",      "hand_r",      "thigh_l",
    "thigh_r",    "calf_l",     "calf_r",     "foot_l",      "foot_r",      "ball_l",      "ball_r",      "thumb_01_l",
    "thumb_01_r", "index_01_l", "index_01_r", "middle_01_l", "middle_01_r", "ring_01_l",   "ring_01_r",   "pinky_01_l",
    "pinky_01_r", "thumb_02_l", "thumb_02_r", "index_02_l",  "index_02_r",  "middle_02_l", "middle_02_r", "ring_02_l",
    "ring_02_r",  "pinky_02_l", "pinky_02_r"};
const std::set<std::string> kVrm{"hips",
                                 "spine",
                                 "chest",
                                 "upperChest",
                                 "neck",
                                 "head",
                                 "leftShoulder",
                                 "rightShoulder",
                                 "leftUpperArm",
                                 "rightUpperArm",
                                 "leftLowerArm",
                                 "rightLowerArm",
                                 "leftHand",
                                 "rightHand",
                                 "leftUpperLeg",
                                 "rightUpperLeg",
                                 "leftLowerLeg",
                                 "rightLowerLeg",
                                 "leftFoot",
                                 "rightFoot",
                                 "leftToes",
                                 "rightToes",
                                 "leftThumbMetacarpal",
                                 "rightThumbMetacarpal",
                                 "leftIndexProximal",
                                 "rightIndexProximal",
                                 "leftMiddleProximal",
                                 "rightMiddleProximal",
                                 "leftRingProximal",
                                 "rightRingProximal",
                                 "leftLittleProximal",
                                 "rightLittleProximal",
                                 "leftThumbProximal",
                                 "rightThumbProximal",
                                 "leftIndexIntermediate",
                                 "rightIndexIntermediate",
                                 "leftMiddleIntermediate",
                                 "rightMiddleIntermediate",
                                 "leftRingIntermediate",
                                 "rightRingIntermediate",
                                 "leftLittleIntermediate",
                                 "rightLittleIntermediate"};

TEST(ShippedSkeletons, HaveAliasesThatEachSchemeKnowsAndNoneTwice) {
  int bodies = 0;
  for (const fs::directory_entry& file :
       fs::directory_iterator(fs::path(support::source_folder()) / "config" / "skeletons")) {
    SCOPED_TRACE(file.path().string());
    const auto skeleton = load_skeleton(file.path());
    ASSERT_TRUE(skeleton) << skeleton.error().message;
    EXPECT_EQ(skeleton->name, file.path().stem());
    if (skeleton->bones.size() == 1) continue;  // a rigid body
    ++bodies;
    std::set<std::string> unity, unreal, vrm;
    for (const Bone& bone : skeleton->bones) {
      EXPECT_TRUE(kUnity.contains(bone.aliases.unity) && unity.insert(bone.aliases.unity).second) << bone.name;
      EXPECT_TRUE(kUnreal.contains(bone.aliases.unreal) && unreal.insert(bone.aliases.unreal).second) << bone.name;
      EXPECT_TRUE(kVrm.contains(bone.aliases.vrm) && vrm.insert(bone.aliases.vrm).second) << bone.name;
    }
  }
  EXPECT_GE(bodies, 2);
}

TEST(ShippedMarkerSets, HaveTheNameOfTheirFile) {
  for (const fs::directory_entry& file : fs::directory_iterator(kMarkerSets)) {
    if (file.path().extension() != ".toml") continue;
    const auto set = load_marker_set(file.path());
    ASSERT_TRUE(set) << set.error().message;
    EXPECT_EQ(set->name, file.path().stem());
  }
}

TEST(ShippedMarkerSets, StandUprightWithTheLeftHandTowardsPlusY) {
  const auto set = load_marker_set(kMarkerSets / "openmocap18.toml");
  ASSERT_TRUE(set) << set.error().message;

  std::vector<Eigen::Vector3d> joints;
  Eigen::Vector3d left_hand, right_hand, head, foot;
  for (const Bone& bone : set->skeleton.bones) {
    joints.push_back(bone.rest_offset_m +
                     (bone.parent < 0 ? Eigen::Vector3d::Zero() : joints[static_cast<std::size_t>(bone.parent)]));
    if (bone.name == "LeftHand") left_hand = joints.back();
    if (bone.name == "RightHand") right_hand = joints.back();
    if (bone.name == "Head") head = joints.back();
    if (bone.name == "LeftFoot") foot = joints.back();
  }

  EXPECT_GT(left_hand.y(), 0.6);
  EXPECT_LT(right_hand.y(), -0.6);
  EXPECT_GT(head.z(), 0.5);
  EXPECT_LT(foot.z(), -0.8);
  EXPECT_EQ(set->skeleton.bones.front().aliases.unity, "Hips");
}

TEST_F(MarkerSetFile, FindsItsSkeletonRelativeToItsOwnFile) {
  write("two.toml", kTwoBones);
  const fs::path file = write("set.toml", R"(name = "set"
skeleton = "two.toml"
marker = [ { name = "C", bone = "Chest", offset_m = [0.1, 0, 0], colour = [1, 0.5, 0] } ]
)");

  const auto set = load_marker_set(file);

  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->skeleton.bones.size(), 2U);
  EXPECT_EQ(set->skeleton.bones[1].parent, 0);
  EXPECT_EQ(set->skeleton.bones[1].aliases.unity, "Spine");
  ASSERT_TRUE(set->skeleton.bones[1].rotation_limits[1]);
  EXPECT_NEAR(set->skeleton.bones[1].rotation_limits[1]->min_rad, -1.5707963, 1e-6);
  EXPECT_FALSE(set->skeleton.bones[1].rotation_limits[2]);
  EXPECT_EQ(set->markers[0].bone, 1);
  EXPECT_DOUBLE_EQ(set->markers[0].offset_m.x(), 0.1);
  EXPECT_FLOAT_EQ(set->markers[0].colour[1], 0.5F);
}

TEST_F(MarkerSetFile, ReadsTheFormerNameOfTheRotationLimits) {
  const fs::path file = write("old.toml", "name = \"old\"\n[[bone]]\nname = \"Hips\"\nturns_deg = { y = [-90, 0] }\n");

  const auto skeleton = load_skeleton(file);

  ASSERT_TRUE(skeleton) << skeleton.error().message;
  ASSERT_TRUE(skeleton->bones[0].rotation_limits[1]);
  EXPECT_NEAR(skeleton->bones[0].rotation_limits[1]->min_rad, -1.5707963, 1e-6);
  EXPECT_FALSE(skeleton->bones[0].rotation_limits[0]);
}

TEST_F(MarkerSetFile, RefusesRotationLimitsWithBothNames) {
  const fs::path file = write("both.toml",
                              "name = \"both\"\n[[bone]]\nname = \"Hips\"\nturns_deg = { y = [-90, 0] }\n"
                              "rotation_limits_deg = { y = [-90, 0] }\n");

  const auto skeleton = load_skeleton(file);

  ASSERT_FALSE(skeleton);
  EXPECT_THAT(skeleton.error().message, HasSubstr("both.toml:4:13: bone 'Hips': turns_deg is the former name of "
                                                  "rotation_limits_deg, expected one of them"));
}

TEST_F(MarkerSetFile, ListsAllFaultsOfBothFilesWithTheirPlaces) {
  write("two.toml", R"(name = "two"
[[bone]]
name = "Hips"
[[bone]]
name = "Chest"
parent = "Hip"
rest_ofset_m = [0.0, 0.0, 250]
rotation_limits_deg = { x = [30, -30] }
)");
  const fs::path file = write("set.toml", R"(name = "set"
skeleton = "two.toml"
marker = [
  { name = "C", bone = "Cheste", offset_m = [180, 0, 0] },
  { name = "C", bone = "Chest", colour = [1, 2, 0] },
]
)");

  const auto set = load_marker_set(file);

  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::InvalidArgument);
  const std::string& message = set.error().message;
  EXPECT_THAT(message, HasSubstr("two.toml:6:10: bone 'Chest': parent is 'Hip', expected an earlier bone, did "
                                 "you mean 'Hips'?"));
  EXPECT_THAT(message,
              HasSubstr("two.toml:7:1: bone 'Chest': unknown key 'rest_ofset_m', did you mean 'rest_offset_m'?"));
  EXPECT_THAT(message, HasSubstr("two.toml:8:"));
  EXPECT_THAT(message,
              HasSubstr("set.toml:4:24: marker 'C': bone is 'Cheste', expected a bone of skeleton 'two', did you "
                        "mean 'Chest'?"));
  EXPECT_THAT(message, HasSubstr("offset_m is [ 180, 0, 0 ], expected 3 numbers from -2 to 2"));
  EXPECT_THAT(message, HasSubstr("the name occurs twice"));
  EXPECT_THAT(message, HasSubstr("colour is [ 1, 2, 0 ]"));
  EXPECT_THAT(message, HasSubstr("set.toml: 8 faults"));
}

constexpr const char* kLegs = R"(name = "legs"
[[bone]]
name = "Hips"
[[bone]]
name = "LeftUpLeg"
parent = "Hips"
rest_offset_m = [0.0, 0.09, -0.08]
[[bone]]
name = "RightUpLeg"
parent = "Hips"
rest_offset_m = [0.0, -0.09, -0.08]
)";

constexpr const char* kLegMarkers = R"(
marker = [
  { name = "Back", bone = "Hips" },
  { name = "LThigh", bone = "LeftUpLeg", offset_m = [0.04, 0.07, -0.19] },
  { name = "RThigh", bone = "RightUpLeg", offset_m = [0.04, -0.07, -0.25] },
  { name = "LKnee", bone = "LeftUpLeg", offset_m = [0.00, 0.06, -0.42] },
  { name = "RKnee", bone = "RightUpLeg", offset_m = [0.01, -0.06, -0.44] },
]
)";

TEST_F(MarkerSetFile, ReadsThePairsThatAreNoMirrorImages) {
  write("legs.toml", kLegs);

  const auto set = load_marker_set(write(
      "set.toml",
      std::string("name = \"s\"\nskeleton = \"legs.toml\"\nasymmetric = [[\"LThigh\", \"RThigh\"]]") + kLegMarkers));

  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->asymmetric, (std::vector<MarkerPair>{{1, 2}}));
}

TEST_F(MarkerSetFile, RefusesPairsThatDoNotDistinguishTheSides) {
  write("legs.toml", kLegs);

  const auto set = load_marker_set(write("set.toml", std::string(R"(name = "s"
skeleton = "legs.toml"
asymmetric = [
  ["LKnee", "RKnee"],
  ["LThigh", "LKnee"],
  ["Back", "Back"],
  ["LThigh", "RThig"],
  ["LThigh"],
  "RThigh",
])") + kLegMarkers));

  ASSERT_FALSE(set);
  const std::string& message = set.error().message;
  EXPECT_THAT(message,
              HasSubstr("set.toml:4:3: asymmetric: 'LKnee' is 20 mm off the mirror image of 'RKnee' as seen from "
                        "the front, expected 35 mm or more; move one of them along its bone"));
  EXPECT_THAT(message,
              HasSubstr("set.toml:5:3: asymmetric: 'LThigh' is on LeftUpLeg and 'LKnee' on LeftUpLeg, expected "
                        "two markers of opposite bones"));
  EXPECT_THAT(message, HasSubstr("set.toml:6:3: asymmetric: 'Back' is on Hips and 'Back' on Hips, expected two"));
  EXPECT_THAT(message,
              HasSubstr("set.toml:7:14: asymmetric: 'RThig' is no marker of this set, did you mean 'RThigh'?"));
  EXPECT_THAT(message,
              HasSubstr("set.toml:8:3: asymmetric: [ 'LThigh' ] is no pair, expected [\"LThigh\", \"RThigh\"]"));
  EXPECT_THAT(message, HasSubstr("set.toml:9:3: asymmetric: 'RThigh' is no pair"));
  EXPECT_THAT(message, HasSubstr("set.toml: 6 faults"));
}

TEST_F(MarkerSetFile, RefusesSidesOfARigidBody) {
  write("thing.toml", "name = \"thing\"\n[[bone]]\nname = \"Body\"\n");

  const auto set = load_marker_set(write("set.toml", R"(name = "s"
skeleton = "thing.toml"
asymmetric = [["A", "B"]]
marker = [ { name = "A", bone = "Body" }, { name = "B", bone = "Body", offset_m = [0.1, 0, 0] } ]
)"));

  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("set.toml:3:14: asymmetric: a rigid body has no left and right side"));
}

TEST_F(MarkerSetFile, OfARigidBodyIsReadBack) {
  const std::filesystem::path config = std::filesystem::path(support::source_folder()) / "config";
  const auto set = load_marker_set(config / "markersets/rigid4.toml");
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_TRUE(save_marker_set(folder_ / "copy.toml", *set, config / "skeletons/rigid1.toml"));

  const auto read = load_marker_set(folder_ / "copy.toml");

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->markers.size(), 4U);
}

TEST_F(MarkerSetFile, NamesTheLineOfATomlSyntaxError) {
  const auto set = load_marker_set(write("set.toml", "name = \"set\"\nskeleton = \n"));

  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("set.toml:2:"));
}

TEST_F(MarkerSetFile, NamesTheMissingFile) {
  EXPECT_EQ(load_marker_set(folder_ / "none.toml").error().code, ErrorCode::NotFound);

  const auto set = load_marker_set(write("set.toml", "name = \"s\"\nskeleton = \"gone.toml\"\nmarker = []\n"));

  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("set.toml:2:12: skeleton is 'gone.toml'"));
  EXPECT_THAT(set.error().message, HasSubstr("neither " + (folder_ / "gone.toml").string() + " nor "));
  EXPECT_THAT(set.error().message, HasSubstr("share/mocapd/markersets/gone.toml exists"));
}

// To read a pipe would wait for its writer; a client may name one.
TEST_F(MarkerSetFile, RefusesAPipe) {
  const fs::path pipe = folder_ / "pipe.toml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);

  const auto set = load_marker_set(pipe);

  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("pipe.toml: is a folder or a device, expected a TOML file"));
}

TEST_F(MarkerSetFile, RefusesAFolderAndNumbersThatAreNotFinite) {
  EXPECT_FALSE(load_marker_set(folder_));

  const auto skeleton = load_skeleton(write("s.toml", "name=\"s\"\n[[bone]]\nname=\"A\"\nrest_offset_m=[nan,0,0]\n"));

  ASSERT_FALSE(skeleton);
  EXPECT_THAT(skeleton.error().message, HasSubstr("s.toml:4:15: bone 'A': rest_offset_m"));
}

}  // namespace marker_set_file_test
}  // namespace mocap::settings
