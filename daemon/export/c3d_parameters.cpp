#include "export/c3d_parameters.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>

namespace mocap::exports {
namespace {

constexpr std::size_t kMaxBlocks = 255;
constexpr std::size_t kMaxTexts = 255;
constexpr char kIntel = 84;

enum Type : int { kCharacters = -1, kInteger = 2, kReal = 4 };

}  // namespace

void append_u16(std::string& bytes, std::uint16_t number) {
  bytes += static_cast<char>(number & 0xFF);
  bytes += static_cast<char>(number >> 8);
}

void append_float(std::string& bytes, float number) {
  const auto bits = std::bit_cast<std::uint32_t>(number);
  append_u16(bytes, static_cast<std::uint16_t>(bits & 0xFFFF));
  append_u16(bytes, static_cast<std::uint16_t>(bits >> 16));
}

void C3dParameters::group(std::string_view name, std::string_view about) {
  ++groups_;
  std::string content(1, static_cast<char>(about.size()));
  content += about;
  end_record(name, -groups_, content);
}

void C3dParameters::parameter(std::string_view name, int type, std::initializer_list<std::size_t> dimensions,
                              std::string_view values, std::string_view about) {
  std::string content(1, static_cast<char>(type));
  content += static_cast<char>(dimensions.size());
  for (const std::size_t dimension : dimensions) content += static_cast<char>(dimension);
  content += values;
  content += static_cast<char>(about.size());
  content += about;
  end_record(name, groups_, content);
}

// Appends a group or a parameter. The offset to the next record counts from its own first byte.
void C3dParameters::end_record(std::string_view name, int id, const std::string& content) {
  records_ += static_cast<char>(name.size());
  records_ += static_cast<char>(id);
  records_ += name;
  last_offset_at_ = records_.size();
  append_u16(records_, static_cast<std::uint16_t>(content.size() + 2));
  records_ += content;
}

void C3dParameters::text(std::string_view name, std::string_view value, std::string_view about) {
  if (value.size() > kMaxText_bytes) too_long_ = value;
  parameter(name, kCharacters, {value.size()}, value, about);
}

void C3dParameters::texts(std::string_view name, std::span<const std::string> values, std::string_view about) {
  std::size_t width = 0;
  for (const std::string& value : values) width = std::max(width, value.size());
  std::string padded;
  for (const std::string& value : values) {
    if (value.size() > kMaxText_bytes) too_long_ = value;
    padded += value;
    padded.append(width - value.size(), ' ');
  }
  parameter(name, kCharacters, {width, values.size()}, padded, about);
}

void C3dParameters::long_texts(const std::string& name, std::span<const std::string> values, std::string_view about) {
  for (std::size_t begin = 0, number = 1; begin < values.size() || number == 1; begin += kMaxTexts, ++number) {
    const std::string numbered = number == 1 ? name : name + std::to_string(number);
    texts(numbered, values.subspan(begin, std::min(kMaxTexts, values.size() - begin)), about);
  }
}

void C3dParameters::integer(std::string_view name, std::uint16_t value, std::string_view about) {
  integers(name, {}, {&value, 1}, about);
}

void C3dParameters::integers(std::string_view name, std::initializer_list<std::size_t> dimensions,
                             std::span<const std::uint16_t> values, std::string_view about) {
  std::string bytes;
  for (const std::uint16_t value : values) append_u16(bytes, value);
  parameter(name, kInteger, dimensions, bytes, about);
}

void C3dParameters::real(std::string_view name, float value, std::string_view about) {
  reals(name, {}, {&value, 1}, about);
}

void C3dParameters::reals(std::string_view name, std::initializer_list<std::size_t> dimensions,
                          std::span<const float> values, std::string_view about) {
  std::string bytes;
  for (const float value : values) append_float(bytes, value);
  parameter(name, kReal, dimensions, bytes, about);
}

Result<std::string> C3dParameters::section() const {
  if (!too_long_.empty()) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("C3D: the name '{}' has {} bytes, expected at most {}; shorten it where it is named (subject, "
                    "marker set or skeleton) and record again, or export another format",
                    too_long_, too_long_.size(), kMaxText_bytes)};
  }
  std::string section("\1P??", 4);
  section += records_;
  // The last record has no next one.
  if (!records_.empty()) section[4 + last_offset_at_] = section[4 + last_offset_at_ + 1] = 0;
  section.append((kBlock_bytes - section.size() % kBlock_bytes) % kBlock_bytes, '\0');
  const std::size_t blocks = section.size() / kBlock_bytes;
  if (blocks > kMaxBlocks) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("C3D: names and descriptions need {} blocks, at most {} are possible; export fewer "
                             "subjects",
                             blocks, kMaxBlocks)};
  }
  section[2] = static_cast<char>(blocks);
  section[3] = kIntel;
  return section;
}

}  // namespace mocap::exports
