#include "corpus/image_figures.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "cameras/replay/image_file.h"
#include "chaos/hash.h"
#include "detect/blob_detector.h"

namespace mocap::corpus {
namespace {

constexpr double kSame_px = 1.0;  // the spots are 6 px apart or more

Result<Blobs> blobs_of(const cameras::GreyImage& pixels) {
  detect::DetectSettings settings;  // as in particles_test: about three times the remaining noise
  settings.threshold = 20.0;
  settings.low_threshold = 10.0;
  settings.min_area_px2 = 3.0;
  settings.grow_px = 1;
  auto detector = detect::make_blob_detector(settings, PixelFormat::Mono8, pixels.width_px, pixels.height_px);
  if (!detector) return detector.error();
  Image image;
  image.width_px = pixels.width_px;
  image.height_px = pixels.height_px;
  image.stride_bytes = static_cast<std::size_t>(pixels.width_px);
  image.bytes = pixels.pixels;
  return (*detector)->detect(image).blobs;
}

double nearest_px(const Blobs& blobs, const Eigen::Vector2d& to) {
  double least_px = std::numeric_limits<double>::infinity();
  for (const Blob& blob : blobs) least_px = std::min(least_px, (blob.centroid.v - to).norm());
  return least_px;
}

}  // namespace

Result<Figures> image_figures_of(const std::filesystem::path& image) {
  const auto pixels = cameras::read_grey_image(image);
  if (!pixels) return pixels.error();
  std::ifstream spots(std::filesystem::path(image).replace_extension(".tsv"));
  if (!spots) return Error{ErrorCode::NotFound, image.string() + ": the list of its spots is missing"};
  const auto blobs = blobs_of(*pixels);
  if (!blobs) return blobs.error();
  Figures figures;
  figures.sets = 1;
  figures.labels = blobs->size();
  chaos::Hash hash;
  for (const Blob& blob : *blobs) {
    for (const double part : {blob.centroid.v.x(), blob.centroid.v.y(), double{blob.area_px2}}) {
      hash.add(std::string_view(reinterpret_cast<const char*>(&part), sizeof part));
    }
  }
  figures.hash = hash.value();
  double squares_px2 = 0.0;
  for (Eigen::Vector2d spot; spots >> spot.x() >> spot.y();) {
    ++figures.judged;
    const double off_px = nearest_px(*blobs, spot);
    if (off_px > kSame_px) {
      ++figures.wrong;
    } else {
      squares_px2 += off_px * off_px;
    }
  }
  const auto right = static_cast<double>(figures.judged - figures.wrong);
  figures.rms = right > 0.0 ? std::sqrt(squares_px2 / right) : 0.0;
  return figures;
}

}  // namespace mocap::corpus
