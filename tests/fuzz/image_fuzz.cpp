#include <array>
#include <filesystem>
#include <string>

#include "base/expects.h"
#include "cameras/jpeg_decoder.h"
#include "cameras/jpeg_encoder.h"
#include "cameras/replay/image_file.h"
#include "cameras/tcp/tcp_header.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"

// Fuzzes the decoders of recorded and received images: PNG, PGM, PPM and JPEG files with bytes changed, removed and
// repeated, and the header of images over TCP. Each image must be decoded or refused with a reason, and have as many
// pixels as its size says.
//
// usage: image_fuzz [COUNT [SEED]]

namespace mocap::cameras {
namespace {

constexpr int kWidth_px = 40, kHeight_px = 24;

std::vector<std::string> jpegs() {
  PreviewImage image;
  image.head.image_width_px = kWidth_px;
  image.head.image_height_px = kHeight_px;
  for (int i = 0; i < kWidth_px * kHeight_px; ++i) image.grey.push_back(static_cast<std::uint8_t>(i * i));
  JpegEncoder encoder;
  const auto jpeg = encoder.encode(image);
  MOCAP_EXPECTS(jpeg.has_value());
  return {std::string(reinterpret_cast<const char*>(jpeg->data()), jpeg->size())};
}

std::vector<std::string> headers() {
  std::string header(kTcpHeader_bytes, '\0');
  header.replace(0, 4, "MCRF");
  header[4] = header[6] = 1;
  header[8] = kWidth_px;
  header[12] = kHeight_px;
  header[32] = static_cast<char>(kWidth_px * kHeight_px & 0xFF);
  header[33] = kWidth_px * kHeight_px >> 8;
  return {header};
}

void check(const Result<GreyImage>& image) {
  if (!image) {
    MOCAP_EXPECTS(!image.error().message.empty());
    return;
  }
  MOCAP_EXPECTS(image->width_px > 0 && image->height_px > 0);
  MOCAP_EXPECTS(image->pixels.size() ==
                static_cast<std::size_t>(image->width_px) * static_cast<std::size_t>(image->height_px));
}

void read_header(const std::string& bytes) {
  if (bytes.size() < kTcpHeader_bytes) return;
  const fuzz::Exact exact(bytes.substr(0, kTcpHeader_bytes));
  TcpSettings settings;
  settings.width_px = kWidth_px;
  settings.height_px = kHeight_px;
  const auto header = parse_tcp_header(exact.bytes().first<kTcpHeader_bytes>(), settings);
  MOCAP_EXPECTS(header || !header.error().message.empty());
}

}  // namespace
}  // namespace mocap::cameras

int main(int argc, char** argv) {
  using namespace mocap;           // NOLINT: the program
  using namespace mocap::cameras;  // NOLINT: the program
  const fuzz::Arguments arguments(argc, argv);
  using Kind = fuzz::Inputs::Kind;
  fuzz::Inputs files(Kind::Binary, arguments.seed, fuzz::files_in("tests/fuzz/seeds/image"));
  fuzz::Inputs compressed(Kind::Binary, arguments.seed + 1, jpegs());
  fuzz::Inputs announced(Kind::Binary, arguments.seed + 2, headers());
  JpegDecoder decoder;
  std::uint64_t decoded = 0;
  for (std::uint64_t i = 0; i < arguments.count; ++i) {
    check(decode_grey_image(fuzz::Exact(files.next()).bytes()));
    const fuzz::Exact jpeg(compressed.next());
    if (const auto grey = decoder.decode(jpeg.bytes(), kWidth_px, kHeight_px)) {
      ++decoded;
      MOCAP_EXPECTS(grey->size() == std::size_t{kWidth_px} * kHeight_px);
    }
    read_header(announced.next());
  }
  arguments.print("images of each kind");
  return decoded > 0 ? 0 : 1;
}
