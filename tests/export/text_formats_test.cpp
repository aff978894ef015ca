#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "export/csv.h"
#include "export/sample_clip.h"
#include "export/trc.h"

namespace mocap::exports {
namespace text_formats_test {

using ::testing::ElementsAre;
using Writer = Status (*)(const Clip&, const WriteOptions&, const Sink&);
using Table = std::vector<std::vector<std::string>>;

// Four decimals of a millimetre, rounded.
constexpr double kSame_mm = 6e-5;

std::string written(Writer write, const Clip& clip, const WriteOptions& options) {
  std::string text;
  const Status done = write(clip, options, [&](std::string_view piece) {
    text += piece;
    return Status{};
  });
  EXPECT_TRUE(done) << done.error().message;
  return text;
}

Table rows_of(const std::string& text, char between) {
  Table rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string>& cells = rows.emplace_back(1);
    for (const char c : line) {
      if (c == between) {
        cells.emplace_back();
      } else {
        cells.back() += c;
      }
    }
  }
  return rows;
}

std::size_t column(const Table& rows, const std::string& name) {
  for (std::size_t i = 0; i < rows[0].size(); ++i) {
    if (rows[0][i] == name) return i;
  }
  ADD_FAILURE() << "no column " << name;
  return 0;
}

TEST(WriteTrc, HasTheHeaderOfOpenSim) {
  const Table rows = rows_of(written(write_trc, testing::sample_clip(), {}), '\t');

  EXPECT_THAT(rows[0], ElementsAre("PathFileType", "4", "(X/Y/Z)", "walk_1.trc"));
  EXPECT_THAT(rows[1], ElementsAre("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate",
                                   "OrigDataStartFrame", "OrigNumFrames"));
  EXPECT_THAT(rows[2], ElementsAre("29.970030", "29.970030", "40", "9", "mm", "29.970030", "101", "40"));
  ASSERT_EQ(rows[3].size(), 3U * 9U + 2U);
  EXPECT_EQ(rows[3][0], "Frame#");
  EXPECT_EQ(rows[3][1], "Time");
  EXPECT_EQ(rows[3][2], "anna:M0");
  EXPECT_EQ(rows[3][5], "anna:M1");
  ASSERT_EQ(rows[4].size(), 3U * 9U + 2U);
  EXPECT_EQ(rows[4][2], "X1");
  EXPECT_EQ(rows[4][28], "Z9");
  EXPECT_THAT(rows[5], ElementsAre(""));
  EXPECT_EQ(rows.size(), 46U);
}

TEST(WriteTrc, HasPositionsAndEmptyCells) {
  const Table rows = rows_of(written(write_trc, testing::sample_clip(), {.axes = Axes::YUp}), '\t');

  for (std::size_t f = 0; f < 40; ++f) {
    const std::vector<std::string>& cells = rows[6 + f];
    ASSERT_EQ(cells.size(), 3U * 9U + 2U) << f;
    EXPECT_EQ(cells[0], std::to_string(f + 1));
    EXPECT_NEAR(std::stod(cells[1]), static_cast<double>(f) * 1001.0 / 30000.0, 1e-8);
    for (std::size_t m = 0; m < 4; ++m) {
      const std::string *x = &cells[2 + 3 * m], *y = x + 1, *z = x + 2;
      if (testing::lost(m, f)) {
        EXPECT_EQ(*x + *y + *z, "");
        continue;
      }
      const Eigen::Vector3d truth_mm = 1e3 * testing::path_m(0, m, static_cast<double>(f));
      EXPECT_NEAR(std::stod(*x), truth_mm.y(), kSame_mm);
      EXPECT_NEAR(std::stod(*y), truth_mm.z(), kSame_mm);
      EXPECT_NEAR(std::stod(*z), truth_mm.x(), kSame_mm);
    }
  }
}

TEST(WriteTrc, RefusesAClipWithoutMarkers) {
  EXPECT_FALSE(write_trc(Clip{}, {}, [](std::string_view) { return Status{}; }));
}

TEST(WriteCsv, HasUnitsInItsHeader) {
  for (const auto& [unit, name] : {std::pair(Unit::Metre, "m"), {Unit::Centimetre, "cm"}, {Unit::Millimetre, "mm"}}) {
    const Table rows = rows_of(written(write_csv, testing::sample_clip(), {.unit = unit}), ',');

    EXPECT_EQ(rows[0][0], "frame");
    EXPECT_EQ(rows[0][1], "time_s");
    const std::size_t x = column(rows, std::string("bob:M2.x_") + name);
    EXPECT_NEAR(std::stod(rows[8][x]), per_metre(unit) * testing::path_m(1, 2, 7.0).x(), 1e-4 * per_metre(unit));
  }
}

TEST(WriteCsv, HasMarkersTimesAndTimecode) {
  const Table rows = rows_of(written(write_csv, testing::sample_clip(), {}), ',');

  ASSERT_EQ(rows.size(), 41U);
  const std::size_t x = column(rows, "anna:M1.x_mm"), state = column(rows, "anna:M1.state");
  const std::size_t residual = column(rows, "anna:M1.residual_mm"), timecode = column(rows, "timecode");
  for (std::size_t f = 0; f < 40; ++f) {
    const std::vector<std::string>& cells = rows[f + 1];
    ASSERT_EQ(cells.size(), rows[0].size());
    EXPECT_EQ(cells[0], std::to_string(100 + f));
    EXPECT_NEAR(std::stod(cells[1]), static_cast<double>(f) * 1001.0 / 30000.0, 1e-9);
    EXPECT_EQ(cells[state], testing::lost(1, f) ? "lost" : "measured");
    EXPECT_EQ(cells[x].empty(), testing::lost(1, f));
    EXPECT_EQ(cells[residual].empty(), testing::lost(1, f));
    if (cells[x].empty()) continue;
    EXPECT_NEAR(std::stod(cells[x]), 1e3 * testing::path_m(0, 1, static_cast<double>(f)).x(), kSame_mm);
  }
  EXPECT_EQ(rows[1 + 3][column(rows, "anna:M0.state")], "filled");
  EXPECT_EQ(rows[1][timecode], "01:02:59;28");
  EXPECT_EQ(rows[3][timecode], "01:03:00;02");  // ;00 and ;01 do not exist
}

TEST(WriteCsv, HasBonesInTheWorldWithTheChosenNames) {
  const Table rows = rows_of(written(write_csv, testing::sample_clip(), {.names = BoneNames::Mannequin}), ',');

  const std::size_t x = column(rows, "anna:bone:spine_01.x_mm"), z = x + 2, qz = x + 5, qw = x + 6;
  for (std::size_t f = 0; f < 40; ++f) {
    const Eigen::Vector3d hips_mm = 1e3 * testing::path_m(0, 0, static_cast<double>(f));
    EXPECT_NEAR(std::stod(rows[f + 1][x]), hips_mm.x(), kSame_mm);
    EXPECT_NEAR(std::stod(rows[f + 1][z]), hips_mm.z() + 250.0, kSame_mm);
    EXPECT_NEAR(std::stod(rows[f + 1][qz]), std::sin(0.005 * static_cast<double>(f)), 1e-7);
    EXPECT_NEAR(std::stod(rows[f + 1][qw]), std::cos(0.005 * static_cast<double>(f)), 1e-7);
  }
}

TEST(WriteCsv, LeavesBonesBelowALostOneEmpty) {
  Clip clip = testing::sample_clip(1);
  clip.subjects[0].bones[0].state = BoneState::Lost;

  const Table rows = rows_of(written(write_csv, clip, {}), ',');

  EXPECT_EQ(rows[1][column(rows, "anna:bone:Chest.x_mm")], "");
  EXPECT_EQ(rows[1][column(rows, "anna:bone:Chest.state")], "lost");
}

TEST(WriteCsv, QuotesNames) {
  Clip clip = testing::sample_clip(1);
  clip.subjects.resize(1);
  clip.subjects[0].subject.marker_set.markers[0].name = "a,\"b\"";

  const std::string text = written(write_csv, clip, {});

  EXPECT_NE(text.find(",\"a,\"\"b\"\".x_mm\","), std::string::npos);
}

}  // namespace text_formats_test
}  // namespace mocap::exports
