#include "trigger/ip4.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>
#include <charconv>

namespace mocap::trigger {

std::optional<std::uint32_t> read_address(std::string_view text) {
  in_addr address{};
  const std::string copy(text);
  const bool whole = copy.find('\0') == std::string::npos;
  if (!whole || ::inet_pton(AF_INET, copy.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

std::optional<Peer> read_peer(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::optional<std::uint32_t> address = read_address(text.substr(0, colon));
  const std::string_view digits = text.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (!address || fault != std::errc{} || end != digits.data() + digits.size() || port == 0) return std::nullopt;
  return Peer{*address, port};
}

std::string address_text(std::uint32_t address) {
  const in_addr raw{htonl(address)};
  std::array<char, INET_ADDRSTRLEN> text{};
  return ::inet_ntop(AF_INET, &raw, text.data(), text.size());
}

}  // namespace mocap::trigger
