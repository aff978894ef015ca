#include "detect/detect_settings.h"

#include <fmt/format.h>

namespace mocap::detect {

void declare_keys(KeyVisitor& keys, DetectSettings& detect) {
  keys.number("threshold", detect.threshold, {1, 255},
              {.help = "a marker's pixels have this grey level or more; estimated from the image noise if absent",
               .example = "180"});
  keys.number(
      "low_threshold", detect.low_threshold, {0, 255},
      {.help = "subtracted from each pixel before it weighs in the centroid, at most threshold; estimated from the "
               "image noise if absent",
       .example = "60"});
  keys.number("min_area_px2", detect.min_area_px2, {1, 1e6}, {.help = "a smaller blob is noise"});
  keys.number("max_area_px2", detect.max_area_px2, {1, 1e6}, {.help = "a larger blob is a window or a lamp"});
  keys.number("min_roundness", detect.min_roundness, {0, 1}, {.help = "a less round blob is a cable or an edge"});
  keys.number("min_peak_grey", detect.min_peak_grey, {0, 255},
              {.help = "a blob whose brightest pixel is darker is a reflection"});
  keys.flag("split_touching", detect.split_touching, {.help = "true: a blob with a waist is split into two markers"});
  keys.number("grow_px", detect.grow_px, {0, 8}, {.help = "margin around the bright pixels whose light still counts"});
}

std::vector<KeyFault> faults_of(const DetectSettings& detect) {
  std::vector<KeyFault> faults;
  if (detect.min_area_px2 > detect.max_area_px2) {
    faults.push_back({"min_area_px2", fmt::format("min_area_px2 is {}, over max_area_px2 = {}", detect.min_area_px2,
                                                  detect.max_area_px2)});
  }
  if (detect.threshold && detect.low_threshold && *detect.low_threshold > *detect.threshold) {
    faults.push_back({"low_threshold", fmt::format("low_threshold is {}, over threshold = {}", *detect.low_threshold,
                                                   *detect.threshold)});
  }
  return faults;
}

}  // namespace mocap::detect
