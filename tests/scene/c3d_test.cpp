// C3D files that this test writes, byte for byte. clip_test.cpp has files of other programs.
#include "scene/c3d.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace mocap::scene {
namespace c3d_test {

constexpr std::size_t kBlock = 512;
enum : std::uint8_t { kIntel = 84, kDec = 85, kMips = 86 };

/// Two points, LASI and an unlabelled one, in two frames; coordinates in half units of the file.
struct Trial {
  std::uint8_t processor = kIntel;
  bool real = false;
  std::string unit = "mm";
  // By frame and point: x, y, z in half units, and the word with camera mask and residual.
  std::array<std::array<int, 4>, 4> samples{
      {{200, -301, 2000, 0x0502}, {1, 2, 3, 0}, {202, -300, 2001, 0x0100}, {0, 0, 0, -1}}};

  std::string bytes() const {
    std::string file(2 * kBlock, '\0');
    file[0] = 2;  // the block of the parameters
    file[1] = 0x50;
    put16(file, 2, 2);  // points
    put16(file, 6, 1);  // first and last frame
    put16(file, 8, 2);
    put16(file, 16, 3);  // the block of the samples
    put_real(file, 20, 1.0);
    file[kBlock + 2] = 1;
    file[kBlock + 3] = static_cast<char>(processor);
    std::size_t at = kBlock + 4;
    at = put_parameter(file, at, "LABELS", -1, {4, 2}, "LASI*001");
    at = put_parameter(file, at, "UNITS", -1, {2}, (unit + "  ").substr(0, 2));
    at = put_parameter(file, at, "SCALE", 4, {}, real_text(real ? -0.5 : 0.5));
    at = put_parameter(file, at, "RATE", 4, {}, real_text(120.0));
    put_group(file, at, "POINT");
    for (const auto& sample : samples) {
      for (std::size_t i = 0; i < 4; ++i) {
        if (real) {
          file += real_text(i < 3 ? 0.5 * sample[i] : sample[i]);
        } else {
          file += static_cast<char>(sample[i] & 0xFF);
          file += static_cast<char>(sample[i] >> 8);
        }
      }
    }
    return file;
  }

 private:
  static void put16(std::string& file, std::size_t at, unsigned value) {
    file[at] = static_cast<char>(value & 0xFFU);
    file[at + 1] = static_cast<char>(value >> 8);
  }
  // Intel: IEEE 754, the low byte first. DEC: an exponent that is larger by two, the high word first.
  std::string real_text(double value) const {
    std::string text(4, '\0');
    if (processor == kDec) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(4.0 * value));
      put16(text, 0, bits >> 16);
      put16(text, 2, bits & 0xFFFFU);
    } else {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
      put16(text, 0, bits & 0xFFFFU);
      put16(text, 2, bits >> 16);
    }
    return text;
  }
  void put_real(std::string& file, std::size_t at, double value) const { file.replace(at, 4, real_text(value)); }
  static std::size_t put_parameter(std::string& file, std::size_t at, const std::string& name, int element_bytes,
                                   const std::string& dimensions, const std::string& data) {
    std::string text{static_cast<char>(name.size()), 1};
    text += name;
    const std::size_t rest = 2 + 2 + dimensions.size() + data.size();
    text += {static_cast<char>(rest), 0, static_cast<char>(element_bytes), static_cast<char>(dimensions.size())};
    text += dimensions + data;
    file.replace(at, text.size(), text);
    return at + text.size();
  }
  static void put_group(std::string& file, std::size_t at, const std::string& name) {
    std::string text{static_cast<char>(name.size()), -1};
    text += name + std::string(2, '\0');
    file.replace(at, text.size(), text);
  }
};

Result<C3d> parse(const std::string& bytes) { return parse_c3d(std::as_bytes(std::span(bytes))); }

TEST(ParseC3d, ReadsIntegersAndRealsInBothByteOrders) {
  for (const std::uint8_t processor : {kIntel, kDec}) {
    for (const bool real : {false, true}) {
      SCOPED_TRACE(testing::Message() << "processor " << int{processor} << " real " << real);
      const auto c3d = parse(Trial{.processor = processor, .real = real}.bytes());

      ASSERT_TRUE(c3d) << c3d.error().message;
      EXPECT_EQ(c3d->rate_hz, 120.0);
      EXPECT_EQ(c3d->labels, (std::vector<std::string>{"LASI", "*001"}));
      ASSERT_EQ(c3d->frames, 2U);
      // Multiples of half a millimetre are exact in 32 bits; the product with 1e-3 is rounded.
      EXPECT_LT((c3d->sample(0, 0).position_m - Eigen::Vector3d(0.1, -0.1505, 1.0)).norm(), 1e-12);
      EXPECT_LT((c3d->sample(1, 0).position_m - Eigen::Vector3d(0.101, -0.15, 1.0005)).norm(), 1e-12);
      EXPECT_EQ(c3d->sample(0, 0).cameras, 0b101) << "cameras 1 and 3";
      EXPECT_NEAR(c3d->sample(0, 0).residual_m, 2 * 0.5e-3, 1e-12);
      EXPECT_EQ(c3d->sample(1, 0).residual_m, 0.0);
    }
  }
}

TEST(ParseC3d, HasNoPositionWhereTheResidualIsNegative) {
  const auto c3d = parse(Trial{}.bytes());

  ASSERT_TRUE(c3d);
  EXPECT_TRUE(c3d->sample(0, 1).there);
  EXPECT_FALSE(c3d->sample(1, 1).there);
}

TEST(ParseC3d, ConvertsTheUnitOfTheFile) {
  for (const auto& [unit, metres] : {std::pair{"m", 1.0}, {"cm", 0.01}, {"in", 0.0254}, {"mm", 0.001}}) {
    const auto c3d = parse(Trial{.unit = unit}.bytes());

    ASSERT_TRUE(c3d);
    EXPECT_NEAR(c3d->sample(0, 0).position_m.x(), 100.0 * metres, 1e-9) << unit;
  }
}

TEST(ParseC3d, OmitsAFrameThatIsCutOff) {
  std::string bytes = Trial{}.bytes();
  bytes.pop_back();

  const auto c3d = parse(bytes);

  ASSERT_TRUE(c3d);
  EXPECT_EQ(c3d->frames, 1U);
}

TEST(ParseC3d, RefusesAFileWithoutAWholeFrame) {
  const std::string bytes = Trial{}.bytes();

  for (const std::size_t length : {std::size_t{0}, kBlock, 2 * kBlock, 2 * kBlock + 15}) {
    const auto c3d = parse(bytes.substr(0, length));
    ASSERT_FALSE(c3d) << length;
    EXPECT_EQ(c3d.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(ParseC3d, TakesNoLabelsFromTextsOfLengthZero) {
  std::string bytes = Trial{}.bytes();
  const std::string named = std::string("LABELS") + static_cast<char>(14) + '\0' + static_cast<char>(-1) + '\2';
  const std::size_t at = bytes.find(named) + named.size();
  // The same length with six more dimensions of 255: 255^6 texts of no byte, which all fit into the file.
  bytes[at - 1] = 7;
  bytes.replace(at, 7, std::string(1, '\0') + std::string(6, '\xff'));

  const auto c3d = parse(bytes);

  ASSERT_TRUE(c3d) << c3d.error().message;
  EXPECT_EQ(c3d->labels, (std::vector<std::string>{"", ""}));
}

TEST(ParseC3d, HasNoPositionWhereTheResidualIsNoNumber) {
  std::string bytes = Trial{.real = true}.bytes();
  bytes.replace(2 * kBlock + 12, 4, std::string("\x00\x00\xC0\x7F", 4));

  const auto c3d = parse(bytes);

  ASSERT_TRUE(c3d) << c3d.error().message;
  EXPECT_FALSE(c3d->sample(0, 0).there);
}

TEST(ParseC3d, RefusesMipsByteOrder) {
  const auto c3d = parse(Trial{.processor = kMips}.bytes());

  ASSERT_FALSE(c3d);
  EXPECT_EQ(c3d.error().code, ErrorCode::Unsupported);
}

TEST(C3dPoints, AreMarkersGhostsOrModelOutputsByTheirLabels) {
  const std::vector<std::string> labels{"LASI", "*12",  "",     "LKneeAngles", "Anna:RSHO", "PELO",
                                        "PELA", "PELL", "PELP", "HEDO",        "Anna:*3"};

  const auto kinds = kinds_of(labels);

  using enum C3dPointKind;
  EXPECT_EQ(kinds, (std::vector<C3dPointKind>{Marker, Ghost, Ghost, ModelOutput, Marker, ModelOutput, ModelOutput,
                                              ModelOutput, ModelOutput, Marker, Ghost}));
}

}  // namespace c3d_test
}  // namespace mocap::scene
