#include "bridges/vmc/osc.h"

#include <bit>
#include <cstdint>

namespace mocap::vmc {
namespace {

// Header of a bundle with time tag 1: immediately.
constexpr std::string_view kHead("#bundle\0\0\0\0\0\0\0\0\1", 16);

void put_word(std::string& into, std::string_view text) {
  into += text;
  into.append(4 - text.size() % 4, '\0');  // at least one zero byte, padded to a multiple of four
}

void put_bits(std::string& into, std::uint32_t bits) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) into.push_back(static_cast<char>((bits >> shift) & 0xFFU));
}

}  // namespace

void OscBundles::add(std::string_view address, std::string_view types, std::string_view word, std::vector<int> wholes,
                     std::vector<float> floats) {
  std::string message;
  put_word(message, address);
  std::string tags(1, ',');
  tags += types;
  put_word(message, tags);
  std::size_t whole = 0;
  std::size_t real = 0;
  for (const char type : types) {
    if (type == 's') put_word(message, word);
    if (type == 'i') put_bits(message, static_cast<std::uint32_t>(wholes.at(whole++)));
    if (type == 'f') put_bits(message, std::bit_cast<std::uint32_t>(floats.at(real++)));
  }
  if (bundles_.empty() || bundles_.back().size() + 4 + message.size() > max_bytes_) bundles_.emplace_back(kHead);
  put_bits(bundles_.back(), static_cast<std::uint32_t>(message.size()));
  bundles_.back() += message;
}

}  // namespace mocap::vmc
