#include "ctl/camera/shot.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "detect/pixel_rows.h"

namespace mocap::ctl {
namespace {

using Colour = std::array<std::uint8_t, 3>;  // red, green, blue

constexpr Colour kBlob{80, 255, 80};
constexpr Colour kMergedBlob{255, 160, 0};

// The digits 0 to 9 in 3x5 px, one octal number per digit: three bits per row, the top row first.
constexpr int kDigitWidth_px = 3;
constexpr int kDigitHeight_px = 5;
constexpr std::array<unsigned, 10> kDigits{075557, 026227, 071747, 071717, 055711,
                                           074717, 074757, 071122, 075757, 075717};

// A colour image; what is drawn outside is left out.
class Canvas {
 public:
  Canvas(int width_px, int height_px)
      : width_px_(width_px),
        height_px_(height_px),
        bytes_(3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {}

  void set(int x, int y, const Colour& colour) {
    if (x < 0 || y < 0 || x >= width_px_ || y >= height_px_) return;
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(x);
    std::ranges::copy(colour, bytes_.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
  }

  void square(int x, int y, int reach, const Colour& colour) {
    for (int i = -reach; i <= reach; ++i) {
      for (const int edge : {-reach, reach}) {
        set(x + i, y + edge, colour);
        set(x + edge, y + i, colour);
      }
    }
  }

  // Writes a number; x and y are its lower left corner.
  void number(int x, int y, std::size_t value, const Colour& colour) {
    for (const char digit : std::to_string(value)) {
      const unsigned shape = kDigits[static_cast<std::size_t>(digit - '0')];
      for (int bit = 0; bit < kDigitWidth_px * kDigitHeight_px; ++bit) {
        if ((shape >> (kDigitWidth_px * kDigitHeight_px - 1 - bit) & 1U) == 0) continue;
        set(x + bit % kDigitWidth_px, y - kDigitHeight_px + 1 + bit / kDigitWidth_px, colour);
      }
      x += kDigitWidth_px + 1;
    }
  }

  // Empty, or the reason why the file cannot be written.
  std::string write_png(const std::filesystem::path& path) const {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(width_px_);
    png.height = static_cast<png_uint_32>(height_px_);
    png.format = PNG_FORMAT_RGB;
    return png_image_write_to_file(&png, path.c_str(), 0, bytes_.data(), 0, nullptr) != 0 ? "" : png.message;
  }

 private:
  int width_px_;
  int height_px_;
  std::vector<std::uint8_t> bytes_;
};

Canvas drawn_in_grey(const Image& image) {
  const std::uint32_t top = std::max(1U, detect::top_of(image.format));
  Canvas canvas(image.width_px, image.height_px);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < image.height_px; ++y) {
    detect::read_pixels(image, y, 0, row);
    for (int x = 0; x < image.width_px; ++x) {
      const auto grey = static_cast<std::uint8_t>(row[static_cast<std::size_t>(x)] * 255U / top);
      canvas.set(x, y, {grey, grey, grey});
    }
  }
  return canvas;
}

}  // namespace

Status save_shot(const std::filesystem::path& path, const Image& image, const Blobs& blobs) {
  if (path.extension() != ".png") {
    return Error{ErrorCode::Io, fmt::format("{}: expected a name that ends in .png", path.string())};
  }
  if (!detect::is_whole(image)) return Error{ErrorCode::Io, "the image is incomplete"};
  Canvas canvas = drawn_in_grey(image);
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const int x = static_cast<int>(std::lround(blobs[i].centroid.v.x()));
    const int y = static_cast<int>(std::lround(blobs[i].centroid.v.y()));
    const int reach = 4 + static_cast<int>(std::sqrt(blobs[i].area_px2 / 3.14159));
    const Colour& colour = blobs[i].merged ? kMergedBlob : kBlob;
    canvas.square(x, y, reach, colour);
    canvas.number(x + reach + 2, y + reach, i, colour);
  }
  const std::string fault = canvas.write_png(path);
  if (fault.empty()) return {};
  return Error{ErrorCode::Io, fmt::format("{} cannot be written: {}", path.string(), fault)};
}

}  // namespace mocap::ctl
