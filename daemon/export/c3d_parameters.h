#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace mocap::exports {

/// A C3D file consists of blocks.
inline constexpr std::size_t kBlock_bytes = 512;

/// A text of the parameter section: 255 of them stay below 32 KiB, because some readers have signed offsets.
inline constexpr std::size_t kMaxText_bytes = 127;

/// Appends a number in Intel byte order.
void append_u16(std::string& bytes, std::uint16_t number);
void append_float(std::string& bytes, float number);

/// The parameter section of a C3D file: groups of named values, Intel byte order.
///
/// Source: "The C3D File Format" (c3d.org), parameter section.
class C3dParameters {
 public:
  /// Begins a group, to which the next parameters belong.
  void group(std::string_view name, std::string_view about);

  void text(std::string_view name, std::string_view value, std::string_view about);
  /// At most 255 texts.
  void texts(std::string_view name, std::span<const std::string> values, std::string_view about);
  /// The texts, 255 in each of NAME, NAME2, NAME3 and so on.
  void long_texts(const std::string& name, std::span<const std::string> values, std::string_view about);
  void integer(std::string_view name, std::uint16_t value, std::string_view about);
  void integers(std::string_view name, std::initializer_list<std::size_t> dimensions,
                std::span<const std::uint16_t> values, std::string_view about);
  void real(std::string_view name, float value, std::string_view about);
  /// The first dimension changes fastest.
  void reals(std::string_view name, std::initializer_list<std::size_t> dimensions, std::span<const float> values,
             std::string_view about);

  /// The section, in blocks of 512 bytes. Its size does not depend on the values of numbers. Fails with InvalidArgument
  /// if it has more than 255 blocks, or if a text has more than 127 bytes.
  Result<std::string> section() const;

 private:
  void parameter(std::string_view name, int type, std::initializer_list<std::size_t> dimensions,
                 std::string_view values, std::string_view about);
  void end_record(std::string_view name, int id, const std::string& content);

  std::string records_;
  std::size_t last_offset_at_ = 0;
  int groups_ = 0;
  std::string too_long_;  // a text; empty: none
};

}  // namespace mocap::exports
