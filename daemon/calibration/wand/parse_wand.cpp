#include "calibration/wand/parse_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

namespace mocap::calibration {

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
  if (marks_mm.size() < 2 || marks_mm.size() > kMaxWandMarkers || marks_mm[0] != 0.0 || !ascending ||
      marks_mm.back() > 10000.0) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("wand is '{}', expected 250, 400 or 500, or the positions of its two or three markers from one "
                    "end in mm, ascending: 0,160,500",
                    text)};
  }
  Wand wand;
  for (const double mm : marks_mm) wand.marks_m.push_back(1e-3 * mm);
  return wand;
}

}  // namespace mocap::calibration
