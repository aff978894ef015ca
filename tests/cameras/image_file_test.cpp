#include "cameras/replay/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>

#include "support/temporary_folder.h"

namespace mocap::cameras {
namespace image_file_test {

using testing::HasSubstr;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }
std::span<const std::byte> bytes_of(const std::vector<unsigned char>& bytes) { return std::as_bytes(std::span(bytes)); }

std::vector<int> values_of(const GreyImage& image) {
  std::vector<int> values;
  for (const std::byte pixel : image.pixels) values.push_back(std::to_integer<int>(pixel));
  return values;
}

// OpenCV's values of the same file.
std::vector<int> expected_of(std::span<const std::byte> file) {
  const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::byte*>(file.data()));
  const cv::Mat grey = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  std::vector<int> values;
  for (int i = 0; i < grey.rows * grey.cols; ++i) values.push_back(grey.data[i]);
  return values;
}

cv::Mat noise(int type) {
  cv::Mat image(7, 5, type);
  cv::RNG random(1);
  random.fill(image, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return image;
}

TEST(ImageFile, ReadsTheSameGreyValuesAsOpenCV) {
  for (const char* ending : {".png", ".pgm", ".ppm"}) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3, CV_8UC4}) {
      const std::string format = ending;
      const bool grey = CV_MAT_CN(type) == 1;
      if ((format == ".pgm" && !grey) || (format == ".ppm" && type != CV_8UC3)) continue;
      std::vector<unsigned char> file;
      ASSERT_TRUE(cv::imencode(ending, noise(type), file));

      const Result<GreyImage> read = decode_grey_image(bytes_of(file));

      ASSERT_TRUE(read) << ending << " " << read.error().message;
      EXPECT_EQ(read->width_px, 5);
      EXPECT_EQ(read->height_px, 7);
      EXPECT_EQ(values_of(*read), expected_of(bytes_of(file))) << ending << " type " << type;
    }
  }
}

TEST(ImageFile, ReadsCommentsInAPgmHeader) {
  const std::string file = "P5 # made by a camera\n# 2 columns\n2 1\n255\nab";

  const Result<GreyImage> read = decode_grey_image(bytes_of(file));

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(values_of(*read), (std::vector<int>{'a', 'b'}));
}

TEST(ImageFile, KeepsTheUpperBitsOfTwelve) {
  const std::string file = std::string("P5 2 1 4095\n\x0f\xff\x01\x00", 16);

  const Result<GreyImage> read = decode_grey_image(bytes_of(file));

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(values_of(*read), (std::vector<int>{255, 16}));
}

TEST(ImageFile, RefusesBrokenImages) {
  std::vector<unsigned char> png;
  ASSERT_TRUE(cv::imencode(".png", noise(CV_8UC1), png));
  const std::string whole_png(png.begin(), png.end());
  std::string changed_png = whole_png;
  changed_png[45] = static_cast<char>(~changed_png[45]);

  for (const std::string& file :
       {std::string("P5"), std::string("P5 2"), std::string("P5 2 1 255"), std::string("P5 2 1 255\na"),
        std::string("P5 0 1 255\n"), std::string("P5 2 1 0\nab"), std::string("P5 2 1 65536\nabcd"),
        std::string("P5 999999999 999999999 255\nab"), std::string("P6 2 1 255\nabcde"), std::string("P5 -2 1 255\nab"),
        whole_png.substr(0, 8), whole_png.substr(0, 30), whole_png.substr(0, whole_png.size() / 2), changed_png}) {
    const Result<GreyImage> read = decode_grey_image(bytes_of(file));

    ASSERT_FALSE(read) << file;
    EXPECT_EQ(read.error().code, ErrorCode::Io) << file;
    EXPECT_THAT(read.error().message, HasSubstr("broken"));
  }
}

TEST(ImageFile, RefusesOtherFormats) {
  for (const std::string file : {"", "P2 1 1 255 7", "GIF89a", "not an image"}) {
    const Result<GreyImage> read = decode_grey_image(bytes_of(file));

    ASSERT_FALSE(read) << file;
    EXPECT_EQ(read.error().code, ErrorCode::Unsupported);
  }
}

TEST(ImageFile, SurvivesRandomChanges) {
  std::vector<unsigned char> png;
  ASSERT_TRUE(cv::imencode(".png", noise(CV_8UC3), png));
  std::vector<unsigned char> pgm;
  ASSERT_TRUE(cv::imencode(".pgm", noise(CV_16UC1), pgm));
  std::mt19937 random(1);

  for (const auto& file : {png, pgm}) {
    for (int round = 0; round < 2000; ++round) {
      std::vector<unsigned char> changed = file;
      for (int i = 0; i < 3; ++i) changed[random() % changed.size()] = static_cast<unsigned char>(random());
      changed.resize(random() % (changed.size() + 1));

      const Result<GreyImage> read = decode_grey_image(bytes_of(changed));

      if (!read) continue;
      EXPECT_EQ(read->pixels.size(),
                static_cast<std::size_t>(read->width_px) * static_cast<std::size_t>(read->height_px));
    }
  }
}

TEST(ImageFile, NamesTheFileThatCannotBeRead) {
  const support::TemporaryFolder folder;

  const Result<GreyImage> missing = read_grey_image(folder.path() / "none.pgm");

  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::Io);
  EXPECT_THAT(missing.error().message, HasSubstr("none.pgm"));
}

}  // namespace image_file_test
}  // namespace mocap::cameras
