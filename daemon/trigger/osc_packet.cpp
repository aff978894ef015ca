#include "trigger/osc_packet.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace mocap::trigger {
namespace {

constexpr std::size_t kMaxValues = 16;
constexpr std::string_view kBundle("#bundle\0", 8);
constexpr std::size_t kTimeTag_bytes = 8;

// Reads the parts of a packet one after the other; empty: the packet ends too early.
class Parts {
 public:
  explicit Parts(std::string_view bytes) : left_(bytes) {}

  bool at_end() const { return left_.empty(); }
  std::string_view rest() const { return left_; }

  std::optional<std::string_view> bytes(std::size_t count) {
    if (left_.size() < count) return std::nullopt;
    const std::string_view taken = left_.substr(0, count);
    left_.remove_prefix(count);
    return taken;
  }

  std::optional<std::uint32_t> bits() {
    const auto four = bytes(4);
    if (!four) return std::nullopt;
    std::uint32_t value = 0;
    for (const char byte : *four) value = value << 8U | static_cast<unsigned char>(byte);
    return value;
  }

  // At least one zero byte ends a text; further ones fill up to a multiple of four.
  std::optional<std::string_view> text() {
    const std::size_t size = left_.find('\0');
    if (size == std::string_view::npos) return std::nullopt;
    const auto padded = bytes((size / 4 + 1) * 4);
    if (!padded || padded->find_first_not_of('\0', size) != std::string_view::npos) return std::nullopt;
    return padded->substr(0, size);
  }

 private:
  std::string_view left_;
};

// Size of a value that is not read; empty: unknown type.
std::optional<std::size_t> size_of(char type) {
  constexpr std::string_view kEmpty = "TFNI", kFour = "fcrm", kEight = "hdt";
  if (kEmpty.find(type) != std::string_view::npos) return 0;
  if (kFour.find(type) != std::string_view::npos) return 4;
  if (kEight.find(type) != std::string_view::npos) return 8;
  return std::nullopt;
}

struct Message {
  std::string address;
  std::vector<OscValue> values;
};

Status add_value(Parts& parts, char type, std::vector<OscValue>& values) {
  const Error ends = refusal("not one complete OSC message: it ends within a value");
  if (type == 's') {
    const auto text = parts.text();
    if (!text) return ends;
    if (!std::ranges::all_of(*text, [](char c) { return static_cast<unsigned char>(c) < 0x80; })) {
      return refusal("has an OSC text that is not ASCII");
    }
    values.emplace_back(std::string(*text));
  } else if (type == 'i') {
    const auto bits = parts.bits();
    if (!bits) return ends;
    values.emplace_back(static_cast<std::int32_t>(*bits));
  } else {
    const auto size = size_of(type);
    if (!size) return refusal(fmt::format("has an OSC value of type '{}', expected s, i or f", type));
    if (!parts.bytes(*size)) return ends;
  }
  return {};
}

Result<Message> read_message(std::string_view packet) {
  Parts parts(packet);
  Message message;
  const auto address = parts.text();
  if (!address || !address->starts_with('/')) return refusal("not an OSC message: it begins with no address");
  message.address = *address;
  if (parts.at_end()) return message;  // of senders from before OSC 1.0
  const auto types = parts.text();
  if (!types || !types->starts_with(',')) return refusal("not an OSC message: no types after the address");
  if (types->size() > kMaxValues + 1) return refusal(fmt::format("has more than {} OSC values", kMaxValues));
  for (const char type : types->substr(1)) {
    if (const Status added = add_value(parts, type, message.values); !added) return added.error();
  }
  if (!parts.at_end()) return refusal("not one OSC message: bytes follow its last value");
  return message;
}

// The message in a bundle of one.
Result<Message> read_bundle(std::string_view packet) {
  Parts parts(packet);
  if (!parts.bytes(kBundle.size()) || !parts.bytes(kTimeTag_bytes)) return refusal("an OSC bundle without a message");
  const auto size = parts.bits();
  if (!size || *size != parts.rest().size()) return refusal("an OSC bundle, expected one with one message");
  return read_message(parts.rest());
}

const std::string* text_at(const Message& message, std::size_t i) {
  return i < message.values.size() ? std::get_if<std::string>(&message.values[i]) : nullptr;
}

Request start_of(const Message& message) {
  Request request;
  request.verb = Verb::Start;
  request.dialect = Dialect::Osc;
  const std::string* slate = text_at(message, 0);
  if (slate == nullptr || slate->empty()) return request;
  request.slate = *slate;
  const auto* take = message.values.size() > 1 ? std::get_if<std::int32_t>(&message.values[1]) : nullptr;
  if (take != nullptr) request.name = fmt::format("{}_{:03}", *slate, *take);
  return request;
}

void put_text(std::string& into, std::string_view text) {
  into += text;
  into.append(4 - text.size() % 4, '\0');
}

void put_bits(std::string& into, std::uint32_t bits) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) into.push_back(static_cast<char>((bits >> shift) & 0xFFU));
}

}  // namespace

Result<Request> read_osc(std::string_view packet) {
  if (packet.size() > kMaxPacket_bytes) {
    return refusal(fmt::format("has {} bytes, expected at most {}", packet.size(), kMaxPacket_bytes));
  }
  const Result<Message> message = packet.starts_with(kBundle) ? read_bundle(packet) : read_message(packet);
  if (!message) return message.error();
  if (message->address == "/RecordStart") return start_of(*message);
  if (message->address == "/RecordStop") {
    Request request;
    request.verb = Verb::Stop;
    request.dialect = Dialect::Osc;
    return request;
  }
  return refusal(fmt::format("is OSC {}, expected /RecordStart or /RecordStop", message->address));
}

std::string write_osc(std::string_view address, const std::vector<OscValue>& values) {
  std::string packet, types = ",", data;
  for (const OscValue& value : values) {
    if (const auto* text = std::get_if<std::string>(&value)) {
      types += 's';
      put_text(data, text->substr(0, text->find('\0')));
    } else {
      types += 'i';
      put_bits(data, static_cast<std::uint32_t>(std::get<std::int32_t>(value)));
    }
  }
  put_text(packet, address);
  put_text(packet, types);
  return packet + data;
}

}  // namespace mocap::trigger
