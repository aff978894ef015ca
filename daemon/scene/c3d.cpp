#include "scene/c3d.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

namespace mocap::scene {
namespace {

constexpr std::size_t kBlock = 512;
constexpr std::uint8_t kMagic = 0x50;
enum class Processor : std::uint8_t { Intel = 84, Dec = 85, Mips = 86 };

Error broken(std::string_view what) { return {ErrorCode::InvalidArgument, "C3D: " + std::string(what)}; }

/// Reads numbers and texts in the byte order of the file. Reading beyond the end gives zeros.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : bytes_(bytes) {}

  Processor processor = Processor::Intel;

  std::size_t size() const { return bytes_.size(); }
  std::uint8_t u8(std::size_t at) const { return at < bytes_.size() ? std::to_integer<std::uint8_t>(bytes_[at]) : 0; }
  std::int8_t i8(std::size_t at) const { return static_cast<std::int8_t>(u8(at)); }
  std::uint16_t u16(std::size_t at) const { return static_cast<std::uint16_t>(u8(at) | u8(at + 1) << 8); }
  std::int16_t i16(std::size_t at) const { return static_cast<std::int16_t>(u16(at)); }
  double real(std::size_t at) const {
    const std::uint32_t low = u16(at), high = u16(at + 2);
    // DEC floats have swapped 16-bit words and an exponent that is larger by two.
    if (processor == Processor::Dec) return 0.25 * std::bit_cast<float>(low << 16 | high);
    return std::bit_cast<float>(high << 16 | low);
  }
  std::string text(std::size_t at, std::size_t length) const {
    std::string text;
    for (std::size_t i = 0; i < length && at + i < size(); ++i) text += static_cast<char>(u8(at + i));
    text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
  }

 private:
  std::span<const std::byte> bytes_;
};

struct Parameter {
  int element_bytes = 0;  // -1: text
  std::vector<std::size_t> dimensions;
  std::size_t at = 0;
};
using Parameters = std::map<std::string, Parameter, std::less<>>;  // "GROUP:NAME"

// A group has a negative id, its parameters the same id with a positive sign. They may stand in any order.
Parameters read_parameters(const Bytes& bytes, std::size_t begin, std::size_t end) {
  std::map<int, std::string> groups;
  std::vector<std::tuple<int, std::string, Parameter>> found;
  std::size_t at = begin + 4;
  while (at + 4 <= end) {
    const auto name_length = static_cast<std::size_t>(std::abs(bytes.i8(at)));
    const int id = bytes.i8(at + 1);
    if (name_length == 0 || id == 0) break;
    const std::string name = bytes.text(at + 2, name_length);
    const std::size_t offset_at = at + 2 + name_length;
    const std::size_t step = bytes.u16(offset_at);
    if (id < 0) {
      groups[-id] = name;
    } else {
      Parameter parameter;
      parameter.element_bytes = bytes.i8(offset_at + 2);
      const std::size_t dimensions = bytes.u8(offset_at + 3);
      for (std::size_t i = 0; i < dimensions; ++i) parameter.dimensions.push_back(bytes.u8(offset_at + 4 + i));
      parameter.at = offset_at + 4 + dimensions;
      found.emplace_back(id, name, parameter);
    }
    if (step == 0) break;
    at = offset_at + step;
  }
  Parameters parameters;
  for (auto& [id, name, parameter] : found) parameters[groups[id] + ":" + name] = parameter;
  return parameters;
}

double number_of(const Bytes& bytes, const Parameters& parameters, std::string_view name, double otherwise) {
  const auto found = parameters.find(name);
  if (found == parameters.end()) return otherwise;
  switch (found->second.element_bytes) {
    case 1: return bytes.u8(found->second.at);
    case 2: return bytes.u16(found->second.at);
    case 4: return bytes.real(found->second.at);
    default: return otherwise;
  }
}

std::vector<std::string> texts_of(const Bytes& bytes, const Parameters& parameters, std::string_view name) {
  std::vector<std::string> texts;
  const auto found = parameters.find(name);
  if (found == parameters.end() || found->second.element_bytes != -1 || found->second.dimensions.empty()) return texts;
  std::size_t count = 1;
  for (std::size_t i = 1; i < found->second.dimensions.size(); ++i) count *= found->second.dimensions[i];
  const std::size_t length = found->second.dimensions[0];
  if (length == 0) return texts;  // any number of empty texts would fit into the file
  for (std::size_t i = 0; i < count && found->second.at + i * length < bytes.size(); ++i) {
    texts.push_back(bytes.text(found->second.at + i * length, length));
  }
  return texts;
}

std::vector<std::string> labels_of(const Bytes& bytes, const Parameters& parameters, std::size_t points) {
  std::vector<std::string> labels = texts_of(bytes, parameters, "POINT:LABELS");
  for (int more = 2; labels.size() < points && more < 100; ++more) {  // 255 labels in each parameter
    const auto next = texts_of(bytes, parameters, "POINT:LABELS" + std::to_string(more));
    if (next.empty()) break;
    labels.insert(labels.end(), next.begin(), next.end());
  }
  labels.resize(points);
  return labels;
}

/// Position and format of the samples in the file.
struct Layout {
  std::size_t begin = 0;
  std::size_t points = 0;
  std::size_t frame_bytes = 0;
  bool real = false;
  double scale = 1.0;  // factor of integer coordinates and of residuals, to the file's unit
  double unit_m = 1e-3;
};

// The fourth number of a sample in a file of reals; one that is not finite means no position.
int word_of(double number) {
  return std::isfinite(number) ? static_cast<int>(std::clamp(number, -32768.0, 32767.0)) : -1;
}

C3dSample read_sample(const Bytes& bytes, const Layout& layout, std::size_t at) {
  C3dSample sample;
  // The fourth word: the high byte is the camera mask, the low byte the residual; negative: no position.
  const int word = layout.real ? word_of(bytes.real(at + 12)) : bytes.i16(at + 6);
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    sample.position_m[axis] =
        layout.unit_m * (layout.real ? bytes.real(at + 4 * i) : layout.scale * bytes.i16(at + 2 * i));
  }
  sample.there = word >= 0 && sample.position_m.allFinite();
  if (!sample.there) sample.position_m.setZero();
  if (sample.there) {
    sample.cameras = static_cast<std::uint8_t>((word >> 8) & 0x7F);
    sample.residual_m = layout.unit_m * layout.scale * (word & 0xFF);
  }
  return sample;
}

Result<Layout> layout_of(const Bytes& bytes, const Parameters& parameters) {
  Layout layout;
  layout.points = bytes.u16(2);
  const std::size_t data_block = bytes.u16(16);
  const double scale = number_of(bytes, parameters, "POINT:SCALE", bytes.real(12));
  const std::string unit = [&] {
    const auto units = texts_of(bytes, parameters, "POINT:UNITS");
    return units.empty() ? std::string("mm") : units[0];
  }();
  layout.unit_m = unit == "m" ? 1.0 : unit == "cm" ? 1e-2 : unit == "in" ? 0.0254 : 1e-3;
  layout.real = scale < 0.0;
  layout.scale = std::abs(scale);
  if (data_block == 0 || layout.points == 0) return broken("the file has no points");
  if (!std::isfinite(scale) || scale == 0.0) return broken("POINT:SCALE is 0 or not finite");
  layout.begin = (data_block - 1) * kBlock;
  const std::size_t analog_values = bytes.u16(4);  // channels times samples, of one frame
  layout.frame_bytes = layout.points * (layout.real ? 16 : 8) + analog_values * (layout.real ? 4 : 2);
  return layout;
}

// The numbers of the first and last frame in the header have 16 bits. Long trials have a parameter of single precision
// with the number of frames; without it the numbers wrap around, and the size of the file is the only bound.
std::size_t declared_frames(const Bytes& bytes, const Parameters& parameters, std::size_t otherwise) {
  const double long_frames = number_of(bytes, parameters, "POINT:LONG_FRAMES", 0.0);
  if (long_frames >= 1.0 && long_frames < 1e9) return static_cast<std::size_t>(long_frames);
  return bytes.u16(8) >= bytes.u16(6) ? bytes.u16(8) - bytes.u16(6) + 1U : otherwise;
}

}  // namespace

Result<C3d> parse_c3d(std::span<const std::byte> raw) {
  Bytes bytes(raw);
  if (bytes.size() < 2 * kBlock || bytes.u8(1) != kMagic || bytes.u8(0) == 0) {
    return broken("not a C3D file: the second byte is not 0x50");
  }
  const std::size_t parameters_at = (bytes.u8(0) - 1U) * kBlock;
  const std::uint8_t processor = bytes.u8(parameters_at + 3);
  if (processor == static_cast<std::uint8_t>(Processor::Mips)) {
    return Error{ErrorCode::Unsupported, "C3D: the file has MIPS byte order; convert it to Intel byte order"};
  }
  if (processor == static_cast<std::uint8_t>(Processor::Dec)) bytes.processor = Processor::Dec;
  const std::size_t parameters_end = std::min(bytes.size(), parameters_at + bytes.u8(parameters_at + 2) * kBlock);
  const Parameters parameters = read_parameters(bytes, parameters_at, parameters_end);
  const auto layout = layout_of(bytes, parameters);
  if (!layout) return layout.error();
  if (layout->begin >= bytes.size()) return broken("the file ends before its first sample");

  C3d c3d;
  c3d.rate_hz = number_of(bytes, parameters, "POINT:RATE", bytes.real(20));
  if (!(c3d.rate_hz > 0.0 && c3d.rate_hz < 1e5)) return broken("POINT:RATE is not between 0 and 100000 Hz");
  c3d.labels = labels_of(bytes, parameters, layout->points);
  const std::size_t complete = (bytes.size() - layout->begin) / layout->frame_bytes;
  c3d.frames = std::min(complete, declared_frames(bytes, parameters, complete));
  if (c3d.frames == 0) return broken("the file ends within its first frame");
  c3d.samples.reserve(c3d.frames * layout->points);
  for (std::size_t frame = 0; frame < c3d.frames; ++frame) {
    const std::size_t at = layout->begin + frame * layout->frame_bytes;
    for (std::size_t point = 0; point < layout->points; ++point) {
      c3d.samples.push_back(read_sample(bytes, *layout, at + point * (layout->real ? 16 : 8)));
    }
  }
  return c3d;
}

std::vector<C3dPointKind> kinds_of(std::span<const std::string> labels) {
  constexpr std::array<std::string_view, 7> kWords{"Angle",        "Force", "Moment",  "Power",
                                                   "CentreOfMass", "GRF",   "Reaction"};
  const auto bare = [](const std::string& label) {  // LASI of "Anna:LASI"
    const std::size_t colon = label.rfind(':');
    return std::string_view(label).substr(colon == std::string::npos ? 0 : colon + 1);
  };
  const auto is_there = [&](const std::string& name) {
    return std::ranges::any_of(labels, [&](const std::string& label) { return bare(label) == name; });
  };
  std::vector<C3dPointKind> kinds;
  for (const std::string& label : labels) {
    const std::string_view name = bare(label);
    C3dPointKind kind = C3dPointKind::Marker;
    if (name.empty() || name[0] == '*') kind = C3dPointKind::Ghost;
    if (std::ranges::any_of(kWords, [&](auto word) { return name.find(word) != std::string_view::npos; })) {
      kind = C3dPointKind::ModelOutput;
    }
    if (name.size() == 4 && std::string_view("OALP").find(name[3]) != std::string_view::npos) {
      const std::string stem(name.substr(0, 3));
      if (is_there(stem + "O") && is_there(stem + "A") && is_there(stem + "L") && is_there(stem + "P")) {
        kind = C3dPointKind::ModelOutput;
      }
    }
    kinds.push_back(kind);
  }
  return kinds;
}

}  // namespace mocap::scene
