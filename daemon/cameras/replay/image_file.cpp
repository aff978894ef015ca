#include "cameras/replay/image_file.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>

namespace mocap::cameras {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t kMaxPixels = std::size_t{1} << 28;
constexpr std::size_t kMaxFile_bytes = 8 * kMaxPixels;

Error broken(std::string_view why) { return {ErrorCode::Io, fmt::format("the image is broken: {}", why)}; }

std::optional<GreyImage> empty_image(std::uint64_t width_px, std::uint64_t height_px) {
  if (width_px == 0 || height_px == 0 || width_px > kMaxPixels || height_px > kMaxPixels / width_px)
    return std::nullopt;
  return GreyImage{static_cast<int>(width_px), static_cast<int>(height_px),
                   std::vector<std::byte>(width_px * height_px)};
}

// --- PGM and PPM: https://netpbm.sourceforge.net/doc/pgm.html
// ---------------------------------------------------------

// The numbers of a netpbm header, which white space and comments separate.
class NetpbmHeader {
 public:
  explicit NetpbmHeader(Bytes file) : file_(file) {}

  // Nothing if no number of at most 9 digits follows.
  std::optional<std::uint32_t> number() {
    while (at_ < file_.size() && (is_space(at()) || at() == '#')) {
      if (at() == '#') {
        while (at_ < file_.size() && at() != '\n') ++at_;
      } else {
        ++at_;
      }
    }
    std::uint32_t value = 0;
    const std::size_t begin = at_;
    for (; at_ < file_.size() && at() >= '0' && at() <= '9'; ++at_) {
      if (at_ - begin == 9) return std::nullopt;
      value = 10 * value + static_cast<std::uint32_t>(at() - '0');
    }
    if (at_ == begin) return std::nullopt;
    return value;
  }

  // The bytes after the single white space that ends the header.
  Bytes pixels() const { return at_ < file_.size() && is_space(at()) ? file_.subspan(at_ + 1) : Bytes{}; }

 private:
  char at() const { return static_cast<char>(file_[at_]); }
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  Bytes file_;
  std::size_t at_ = 2;  // after the magic number
};

// Luminance in fixed point with 14 bits, rounded: the weights add up to 1.
std::byte luminance(std::byte red, std::byte green, std::byte blue) {
  constexpr unsigned kRed = 4899, kGreen = 9617, kBlue = 1868;  // 0.299, 0.587, 0.114
  const unsigned sum = kRed * std::to_integer<unsigned>(red) + kGreen * std::to_integer<unsigned>(green) +
                       kBlue * std::to_integer<unsigned>(blue);
  return static_cast<std::byte>((sum + (1U << 13)) >> 14);
}

Result<GreyImage> decode_netpbm(Bytes file) {
  const std::size_t channels = file[1] == std::byte{'6'} ? 3 : 1;
  NetpbmHeader header(file);
  const auto width = header.number(), height = header.number(), top = header.number();
  if (!width || !height || !top || *top == 0 || *top > 65535) return broken("no valid header of a PGM or PPM file");
  std::optional<GreyImage> image = empty_image(*width, *height);
  if (!image) return broken(fmt::format("its size is {}x{}", *width, *height));
  const std::size_t bytes_per_sample = *top > 255 ? 2 : 1;
  const Bytes samples = header.pixels();
  if (samples.size() < image->pixels.size() * channels * bytes_per_sample) return broken("it is cut short");
  const int extra_bits = std::max(0, static_cast<int>(std::bit_width(*top)) - 8);
  const auto sample = [&](std::size_t index) {
    if (bytes_per_sample == 1) return samples[index];
    const unsigned value =
        std::to_integer<unsigned>(samples[2 * index]) << 8 | std::to_integer<unsigned>(samples[2 * index + 1]);
    return static_cast<std::byte>(std::min(value, *top) >> extra_bits);
  };
  if (channels == 1 && bytes_per_sample == 1) {
    std::copy_n(samples.begin(), image->pixels.size(), image->pixels.begin());
  } else if (channels == 1) {
    for (std::size_t i = 0; i < image->pixels.size(); ++i) image->pixels[i] = sample(i);
  } else {
    for (std::size_t i = 0; i < image->pixels.size(); ++i)
      image->pixels[i] = luminance(sample(3 * i), sample(3 * i + 1), sample(3 * i + 2));
  }
  return *std::move(image);
}

// --- PNG, by libpng
// ---------------------------------------------------------------------------------------------------

// libpng reports a fault by a long jump. The functions with setjmp have no objects with destructors.
struct PngRead {
  Bytes left;
  std::array<char, 128> fault{};
};

extern "C" void take_png_fault(png_structp png, png_const_charp message) {
  auto* const read = static_cast<PngRead*>(png_get_error_ptr(png));
  std::strncpy(read->fault.data(), message, read->fault.size() - 1);
  png_longjmp(png, 1);
}

extern "C" void ignore_png_warning(png_structp /*png*/, png_const_charp /*message*/) {}

extern "C" void give_png_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto* const read = static_cast<PngRead*>(png_get_io_ptr(png));
  if (count > read->left.size()) png_error(png, "it is cut short");
  std::memcpy(to, read->left.data(), count);
  read->left = read->left.subspan(count);
}

class PngDecoder {
 public:
  explicit PngDecoder(Bytes file)
      : read_{file, {}},
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &read_, take_png_fault, ignore_png_warning)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {
    if (png_ != nullptr) png_set_read_fn(png_, &read_, give_png_bytes);
  }
  ~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;

  // Reads up to the first pixel. The rows will have one byte per pixel.
  bool read_header() {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_info(png_, info_);
    const int colours = png_get_color_type(png_, info_);
    png_set_strip_16(png_);
    png_set_strip_alpha(png_);
    if (colours == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if ((colours & PNG_COLOR_MASK_COLOR) == 0) {
      png_set_expand_gray_1_2_4_to_8(png_);
    } else {
      png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    }
    passes_ = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  bool read_pixels(std::byte* pixels) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    for (int pass = 0; pass < passes_; ++pass) {
      for (std::uint32_t row = 0; row < height_px(); ++row)
        png_read_row(png_, reinterpret_cast<png_bytep>(pixels + std::size_t{row} * width_px()), nullptr);
    }
    png_read_end(png_, nullptr);
    return true;
  }

  std::uint32_t width_px() const { return png_get_image_width(png_, info_); }
  std::uint32_t height_px() const { return png_get_image_height(png_, info_); }
  std::size_t row_bytes() const { return png_get_rowbytes(png_, info_); }
  const char* fault() const { return read_.fault.front() != '\0' ? read_.fault.data() : "out of memory"; }

 private:
  PngRead read_;
  png_structp png_;
  png_infop info_;
  int passes_ = 1;
};

Result<GreyImage> decode_png(Bytes file) {
  PngDecoder decoder(file);
  if (!decoder.read_header()) return broken(decoder.fault());
  std::optional<GreyImage> image = empty_image(decoder.width_px(), decoder.height_px());
  if (!image) return broken(fmt::format("its size is {}x{}", decoder.width_px(), decoder.height_px()));
  if (decoder.row_bytes() != decoder.width_px()) return broken("its pixels cannot be read as grey");
  if (!decoder.read_pixels(image->pixels.data())) return broken(decoder.fault());
  return *std::move(image);
}

}  // namespace

Result<GreyImage> decode_grey_image(Bytes file) {
  constexpr std::array<unsigned char, 8> kPng{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (file.size() >= kPng.size() && std::memcmp(file.data(), kPng.data(), kPng.size()) == 0) return decode_png(file);
  const bool netpbm =
      file.size() >= 2 && file[0] == std::byte{'P'} && (file[1] == std::byte{'5'} || file[1] == std::byte{'6'});
  if (netpbm) return decode_netpbm(file);
  return Error{ErrorCode::Unsupported, "the image is neither PNG nor binary PGM or PPM"};
}

Result<GreyImage> read_grey_image(const std::filesystem::path& file) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  std::ifstream in(file, std::ios::binary);
  if (failed || !in) return Error{ErrorCode::Io, fmt::format("cannot read {}", file.string())};
  if (size > kMaxFile_bytes) return Error{ErrorCode::Io, fmt::format("{} is too large for an image", file.string())};
  std::vector<std::byte> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  Result<GreyImage> image = decode_grey_image(bytes);
  if (!image) return Error{image.error().code, fmt::format("cannot read {}: {}", file.string(), image.error().message)};
  return image;
}

}  // namespace mocap::cameras
