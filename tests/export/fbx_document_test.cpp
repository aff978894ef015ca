#include "export/fbx_document.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace mocap::exports {
namespace fbx_document_test {

// The value of the enumeration TimeMode: after its name come the texts "enum", "" and "", each with type and length.
std::int32_t time_mode_of(const Rate& rate) {
  Clip clip;
  clip.rate = rate;
  clip.frames = 1;
  std::string bytes;
  fbx_global_settings(clip).append_to(bytes);
  const std::size_t type = bytes.find("TimeMode") + 8 + (5 + 4) + 5 + 5;
  EXPECT_EQ(bytes.at(type), 'I');
  std::int32_t mode = 0;
  std::memcpy(&mode, bytes.data() + type + 1, sizeof mode);
  return mode;
}

TEST(FbxDocument, NamesUsualFrameRatesAndMarksOthersAsCustom) {
  EXPECT_EQ(time_mode_of({120, 1}), 1);
  EXPECT_EQ(time_mode_of({60000, 1001}), 17);
  EXPECT_EQ(time_mode_of({240, 2}), 1) << "the same rate";
  EXPECT_EQ(time_mode_of({90, 1}), 14);
}

TEST(FbxDocument, CountsTicksOfLongClipsWithoutOverflow) {
  constexpr std::int64_t kSecond = 46186158000;
  EXPECT_EQ(fbx_ticks({120, 1}, 60), kSecond / 2);
  EXPECT_EQ(fbx_ticks({30000, 1001}, 30), kSecond * 1001 / 1000);
  EXPECT_EQ(fbx_ticks({120, 1}, std::size_t{120} * 86400 * 365), kSecond * 86400 * 365);
}

}  // namespace fbx_document_test
}  // namespace mocap::exports
