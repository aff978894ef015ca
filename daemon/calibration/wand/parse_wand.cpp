#include "calibration/wand/parse_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

namespace mocap::calibration {

Result<Wand> wand_of(const std::vector<double>& marks_m) {
  const bool ascending = std::ranges::adjacent_find(marks_m, std::greater_equal<>{}) == marks_m.end();
  const bool finite = std::ranges::all_of(marks_m, [](double mark) { return std::isfinite(mark); });
  if (!finite || marks_m.size() < 2 || marks_m.size() > kMaxWandMarkers || marks_m[0] != 0.0 || !ascending) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("wand has {} markers, expected the positions of two or three from one end, ascending from 0",
                    marks_m.size())};
  }
  if (marks_m.back() < kShortestWand_m || marks_m.back() > kLongestWand_m) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("wand is {:.6g} mm long, expected {:.0f} to {:.0f} mm{}", 1e3 * marks_m.back(),
                             1e3 * kShortestWand_m, 1e3 * kLongestWand_m,
                             marks_m.back() < kShortestWand_m ? "; are these centimetres?" : "")};
  }
  return Wand{marks_m};
}

Result<Wand> parse_wand(const std::string& text) {
  static const std::map<std::string, std::vector<double>> kPresets{
      {"500", {0.0, 160.0, 500.0}}, {"400", {0.0, 130.0, 400.0}}, {"250", {0.0, 80.0, 250.0}}};
  std::vector<double> marks_mm;
  if (const auto preset = kPresets.find(text); preset != kPresets.end()) {
    marks_mm = preset->second;
  } else {
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
      std::istringstream number(part);
      double mm = 0.0;
      if (!(number >> mm) || !number.eof() || !std::isfinite(mm)) mm = -1.0;
      marks_mm.push_back(mm);
    }
  }
  const bool ascending = std::ranges::adjacent_find(marks_mm, std::greater_equal<>{}) == marks_mm.end();
  if (marks_mm.size() < 2 || marks_mm.size() > kMaxWandMarkers || marks_mm[0] != 0.0 || !ascending) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("wand is '{}', expected 250, 400 or 500, or the positions of its two or three markers from one "
                    "end in mm, ascending: 0,160,500",
                    text)};
  }
  std::vector<double> marks_m;
  for (const double mm : marks_mm) marks_m.push_back(1e-3 * mm);
  return wand_of(marks_m);
}

}  // namespace mocap::calibration
