#include "settings/rig/rig_masks.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "settings/rig/rig_file.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace rig_masks_test {

using testing::HasSubstr;

// A rig file with comments and keys that only its author knows.
constexpr const char* kRig = R"(# our hall, camera heights checked with a tape
[west]   # over the door
name = "west"
size = [640, 480]
matrix = [[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]]
rotation = [0.1, 0.2, 0.30000]
translation = [0, 0, 3]   # measured
mask = [[[0, 0], [9, 0], [9, 9]]]  # the window

[east]
size = [640, 480]
matrix = [[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]]
rotation = [0.1, 0.2, 0.3]
translation = [1, 0, 3]

[metadata]
wand_m = [0.5, 0.2]
)";

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

CameraModel camera(const std::string& name, std::vector<MaskPolygon> learnt) {
  CameraModel made;
  made.name = name;
  made.learnt_masks = std::move(learnt);
  return made;
}

const MaskPolygon kLamp{{{10.0, 20.0}}, {{30.0, 20.0}}, {{30.0, 40.5}}};
const MaskPolygon kDoor{{{110.0, 20.0}}, {{130.0, 20.0}}, {{130.0, 40.0}}, {{120.0, 50.0}}};

class LearntMasks : public testing::Test {
 protected:
  support::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.write("rig.toml", kRig);
};

TEST_F(LearntMasks, AreReadBackAndEveryOtherByteIsKept) {
  ASSERT_TRUE(save_masks(path_, {camera("west", {kLamp, kDoor}), camera("east", {kDoor})}, kLearntMasks));

  const auto rig = load_rig(path_);
  ASSERT_TRUE(rig) << to_text(rig.error());
  ASSERT_EQ((*rig)[0].learnt_masks.size(), 2U);
  EXPECT_EQ((*rig)[0].learnt_masks[0][2].v, Eigen::Vector2d(30.0, 40.5));
  EXPECT_EQ((*rig)[0].masks.size(), 1U);
  ASSERT_EQ((*rig)[1].learnt_masks.size(), 1U);
  EXPECT_EQ((*rig)[1].learnt_masks[0].size(), 4U);
  std::string left = text_of(path_);
  for (const char* key : {"mask_learnt", "mask_learnt"}) {
    const std::size_t begin = left.find(key);
    const std::size_t end = left.find("\n]\n", begin) + 3;
    left.erase(begin, end - begin);
  }
  EXPECT_EQ(left, kRig);
}

TEST_F(LearntMasks, ReplaceThoseLearnedBefore) {
  ASSERT_TRUE(save_masks(path_, {camera("west", {kLamp, kDoor}), camera("east", {kDoor})}, kLearntMasks));
  const std::string first = text_of(path_);

  ASSERT_TRUE(save_masks(path_, {camera("west", {kDoor})}, kLearntMasks));
  const auto rig = load_rig(path_);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ((*rig)[0].learnt_masks.size(), 1U);
  EXPECT_EQ((*rig)[1].learnt_masks.size(), 1U) << "a camera that is not named keeps its own";

  ASSERT_TRUE(save_masks(path_, {camera("west", {kLamp, kDoor})}, kLearntMasks));
  EXPECT_EQ(text_of(path_), first);
}

TEST_F(LearntMasks, AreRemovedFromTheFileIfThereAreNone) {
  ASSERT_TRUE(save_masks(path_, {camera("west", {kLamp}), camera("east", {kDoor})}, kLearntMasks));

  ASSERT_TRUE(save_masks(path_, {camera("west", {}), camera("east", {})}, kLearntMasks));

  EXPECT_EQ(text_of(path_), kRig);
}

TEST_F(LearntMasks, AreWrittenIntoAFileThatEndsWithoutANewline) {
  folder_.write("rig.toml",
                "[east]\nsize = [1, 1]\nmatrix = [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
                "rotation = [0, 0, 0]\ntranslation = [0, 0, 3]");

  ASSERT_TRUE(save_masks(path_, {camera("east", {kDoor})}, kLearntMasks));

  const auto rig = load_rig(path_);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ(rig->front().learnt_masks.size(), 1U);
}

TEST_F(LearntMasks, AreNotWrittenIntoAFileThatCannotBeEdited) {
  const std::string braces = "east = { size = [1, 1] }\n";
  folder_.write("rig.toml", braces);
  const auto in_braces = save_masks(path_, {camera("east", {kDoor})}, kLearntMasks);
  ASSERT_FALSE(in_braces);
  EXPECT_THAT(in_braces.error().message, HasSubstr("camera 'east' stands in braces, expected a table [east]"));
  EXPECT_EQ(text_of(path_), braces);

  folder_.write("rig.toml", "[east\n");
  EXPECT_FALSE(save_masks(path_, {camera("east", {kDoor})}, kLearntMasks));
  EXPECT_FALSE(save_masks(folder_.path() / "none.toml", {camera("east", {kDoor})}, kLearntMasks));
}

TEST_F(LearntMasks, OfACameraThatIsNotInTheFileAreNamedAndTheOthersSaved) {
  const auto unsaved =
      save_masks(path_, {camera("west", {kLamp}), camera("south", {kDoor}), camera("north", {})}, kLearntMasks);

  ASSERT_TRUE(unsaved) << unsaved.error().message;
  EXPECT_THAT(*unsaved, testing::ElementsAre("south"));
  EXPECT_THAT(no_place_for_masks(path_, *unsaved), HasSubstr("has no camera 'south': these masks have no place"));
  const auto rig = load_rig(path_);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ((*rig)[0].learnt_masks.size(), 1U);
}

TEST_F(LearntMasks, StayWhenMasksAreDrawn) {
  ASSERT_TRUE(save_masks(path_, {camera("east", {kDoor})}, kLearntMasks));
  CameraModel drawn;
  drawn.name = "east";
  drawn.masks = {kLamp};
  const std::string before = text_of(path_);

  ASSERT_TRUE(save_masks(path_, {drawn}, kDrawnMasks));

  const auto rig = load_rig(path_);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ((*rig)[0].masks.size(), 1U) << "a camera that is not named keeps its own";
  EXPECT_EQ((*rig)[1].masks[0][2].v, Eigen::Vector2d(30.0, 40.5));
  EXPECT_EQ((*rig)[1].learnt_masks.size(), 1U);
  drawn.masks.clear();
  ASSERT_TRUE(save_masks(path_, {drawn}, kDrawnMasks));
  EXPECT_EQ(text_of(path_), before);
}

}  // namespace rig_masks_test
}  // namespace mocap::settings
