#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "base/expects.h"
#include "detect/blob_detector.h"
#include "detect/kernels/detect_kernels.h"
#include "detect/pixel_rows.h"
#include "fuzz/fuzz_arguments.h"

// Fuzzes the detector with images of every format, with right and wrong sizes and strides. Each image is in a memory
// block of its exact size, so that the address sanitizer detects reads beyond its end. Blobs must be finite and inside
// the image.
//
// usage: detect_fuzz [COUNT [SEED]]

namespace mocap::fuzz {
namespace {

constexpr PixelFormat kFormats[] = {PixelFormat::Mono8,        PixelFormat::Mono10,   PixelFormat::Mono12,
                                    PixelFormat::Mono10p,      PixelFormat::Mono12p,  PixelFormat::Mono10Packed,
                                    PixelFormat::Mono12Packed, PixelFormat::BayerGr8, PixelFormat::BayerRg8,
                                    PixelFormat::Yuyv,         PixelFormat::Nv12,     PixelFormat::Mjpeg};

int below(std::mt19937_64& random, int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); }

std::size_t row_bytes(PixelFormat format, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  switch (format) {
    case PixelFormat::Mono10:
    case PixelFormat::Mono12:
    case PixelFormat::Yuyv: return 2 * width;
    case PixelFormat::Mono10p: return (width * 10 + 7) / 8;
    case PixelFormat::Mono12p:
    case PixelFormat::Mono10Packed:
    case PixelFormat::Mono12Packed: return (width * 12 + 7) / 8;
    default: return width;
  }
}

/// Fills an image with bright patches on a dark background, with white, or with random bytes.
void fill(std::mt19937_64& random, std::span<std::byte> bytes) {
  const int kind = below(random, 4);
  const auto dark = static_cast<std::byte>(below(random, 40));
  for (std::byte& each : bytes) each = kind == 0 ? static_cast<std::byte>(random()) : kind == 1 ? std::byte{255} : dark;
  for (int i = 0; kind >= 2 && !bytes.empty() && i < 20; ++i) {
    const std::size_t begin = random() % bytes.size();
    const std::size_t length = std::min<std::size_t>(bytes.size() - begin, random() % 40);
    for (std::byte& each : bytes.subspan(begin, length)) each = static_cast<std::byte>(random());
  }
}

void check(const Detection& found, const Image& image) {
  for (const Blob& blob : found.blobs) {
    MOCAP_EXPECTS(std::isfinite(blob.sigma_px) && blob.sigma_px > 0.0 && blob.area_px2 >= 1.0);
    MOCAP_EXPECTS(blob.centroid.v.x() >= -1.0 && blob.centroid.v.x() <= image.width_px);
    MOCAP_EXPECTS(blob.centroid.v.y() >= -1.0 && blob.centroid.v.y() <= image.height_px);
    MOCAP_EXPECTS(blob.roundness >= 0.0 && blob.roundness <= 1.0 && blob.peak >= 0.0 && blob.peak <= 1.0);
  }
}

void try_once(std::mt19937_64& random, const std::vector<const detect::DetectKernels*>& kernels) {
  const PixelFormat format = kFormats[random() % std::size(kFormats)];
  const int width = 1 + below(random, below(random, 4) == 0 ? 700 : 90), height = 1 + below(random, 60);
  detect::DetectSettings settings;
  if (below(random, 2) == 0) settings.threshold = 1.0 + below(random, 255);
  settings.min_area_px2 = 1.0 + below(random, 6);
  settings.max_area_px2 = 1e6;
  settings.min_roundness = below(random, 2) * 0.3;
  settings.grow_px = below(random, 9);
  std::vector<MaskPolygon> masks;
  if (below(random, 3) == 0) {
    masks.emplace_back();
    for (int i = 0; i < 5; ++i) masks[0].push_back({{below(random, 200) - 50.0, below(random, 200) - 50.0}});
  }
  auto made = detect::make_blob_detector(settings, format, width, height, masks, kernels[random() % kernels.size()]);
  if (!made) return;
  const std::size_t least = row_bytes(format, width);
  Image image;
  image.stride_bytes = least + (below(random, 2) == 0 ? 0 : random() % 9);
  if (below(random, 8) == 0) image.stride_bytes = random() % (least + 3);
  image.width_px = width;
  image.height_px = height;
  image.format = format;
  // The size that the format needs; in one of eight cases less.
  std::size_t size = image.stride_bytes * static_cast<std::size_t>(height - 1) + least;
  if (below(random, 8) == 0) size = random() % (size + 1);
  const auto memory = std::make_unique<std::byte[]>(std::max<std::size_t>(1, size));
  image.bytes = std::span(memory.get(), size);
  fill(random, std::span(memory.get(), size));
  check((*made)->detect(image), image);
}

}  // namespace
}  // namespace mocap::fuzz

int main(int argc, char** argv) {
  const mocap::fuzz::Arguments arguments(argc, argv);
  std::mt19937_64 random(arguments.seed);
  const auto kernels = mocap::detect::all_kernels();
  for (std::uint64_t i = 0; i < arguments.count; ++i) mocap::fuzz::try_once(random, kernels);
  arguments.print("images");
  return 0;
}
