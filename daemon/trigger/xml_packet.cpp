#include "trigger/xml_packet.h"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <utility>

namespace mocap::trigger {
namespace {

constexpr int kMaxDepth = 4;
constexpr int kMaxElements = 64;
constexpr double kMaxDelay_ms = 600'000;
constexpr std::string_view kAround("\0 \t\r\n", 5);
constexpr const char* kDeclaration = R"(<?xml version="1.0" encoding="UTF-8" standalone="no"?>)";

std::string_view trimmed(std::string_view packet) {
  const std::size_t begin = packet.find_first_not_of(kAround);
  if (begin == std::string_view::npos) return {};
  return packet.substr(begin, packet.find_last_not_of(kAround) - begin + 1);
}

// The root element of a document with its attributes, and the values of its children: the attribute VALUE, or the text.
struct Document {
  std::string root;
  std::map<std::string, std::string> attributes;
  std::map<std::string, std::string> children;
};

// Expat calls the functions below with the reader as user data.
class Reader {
 public:
  Result<Document> read(std::string_view text) {
    const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr), XML_ParserFree);
    if (parser == nullptr) return Error{ErrorCode::Io, "no memory to read the packet"};
    parser_ = parser.get();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, on_begin, on_end);
    XML_SetCharacterDataHandler(parser_, on_text);
    XML_SetStartDoctypeDeclHandler(parser_, on_type);
    const XML_Status status = XML_Parse(parser_, text.data(), static_cast<int>(text.size()), XML_TRUE);
    if (!fault_.empty()) return refusal(fault_);
    if (status != XML_STATUS_OK) {
      return refusal(fmt::format("not one complete XML document: {} at byte {}",
                                 XML_ErrorString(XML_GetErrorCode(parser_)), XML_GetCurrentByteIndex(parser_)));
    }
    return std::move(document_);
  }

 private:
  static void on_begin(void* reader, const char* name, const char** attributes) {
    static_cast<Reader*>(reader)->begin(name, attributes);
  }
  static void on_end(void* reader, const char*) { --static_cast<Reader*>(reader)->depth_; }
  static void on_text(void* reader, const char* text, int size) {
    static_cast<Reader*>(reader)->add_text({text, static_cast<std::size_t>(size)});
  }
  static void on_type(void* reader, const char*, const char*, const char*, int) {
    static_cast<Reader*>(reader)->refuse("has a document type, expected none");
  }

  void begin(const char* name, const char** attributes) {
    if (++depth_ > kMaxDepth) return refuse(fmt::format("is nested deeper than {}", kMaxDepth));
    if (++elements_ > kMaxElements) return refuse(fmt::format("has more than {} elements", kMaxElements));
    child_ = nullptr;
    if (depth_ == 1) document_.root = name;
    if (depth_ == 2) child_ = &document_.children[name];
    const char* value = nullptr;
    for (const char** each = attributes; *each != nullptr; each += 2) {
      if (depth_ == 1) document_.attributes[each[0]] = each[1];
      if (depth_ == 2 && std::string_view(each[0]) == "VALUE") value = each[1];
    }
    if (value == nullptr) return;
    *std::exchange(child_, nullptr) = value;  // text beside it is white space
  }

  void add_text(std::string_view text) {
    if (depth_ == 2 && child_ != nullptr) *child_ += text;
  }

  void refuse(std::string why) {
    fault_ = std::move(why);
    XML_StopParser(parser_, XML_FALSE);
  }

  XML_Parser parser_ = nullptr;
  Document document_;
  std::string* child_ = nullptr;  // at depth 2
  int depth_ = 0;
  int elements_ = 0;
  std::string fault_;
};

std::string value_of(const std::map<std::string, std::string>& values, const char* key) {
  const auto found = values.find(key);
  return found != values.end() ? found->second : std::string();
}

Result<Duration> read_delay(const std::string& text) {
  if (text.empty()) return Duration{};
  double delay_ms = 0.0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), delay_ms);
  if (fault != std::errc{} || end != text.data() + text.size() || !(delay_ms >= 0.0 && delay_ms <= kMaxDelay_ms)) {
    return refusal(fmt::format("Delay is '{}', expected 0 to {} ms", text, kMaxDelay_ms));
  }
  return from_s(delay_ms * 1e-3);
}

Result<Request> capture_of(const Document& document, Verb verb, bool xsens) {
  Request request;
  request.verb = verb;
  request.dialect = xsens ? Dialect::CaptureAck : Dialect::Capture;
  request.name = value_of(document.children, "Name");
  request.notes = value_of(document.children, "Notes");
  request.description = value_of(document.children, "Description");
  request.packet_id = value_of(document.children, "PacketID");
  request.result = value_of(document.attributes, "RESULT");
  if (!request.result.empty() && request.result != "SUCCESS" && request.result != "FAIL" &&
      request.result != "CANCEL") {
    return refusal(fmt::format("RESULT is '{}', expected SUCCESS, FAIL or CANCEL", request.result));
  }
  if (verb == Verb::Stop && request.result == "CANCEL") request.verb = Verb::Cancel;
  const Result<Duration> delay = read_delay(value_of(document.children, "Delay"));
  if (!delay) return delay.error();
  if (verb == Verb::Start) request.delay = *delay;
  return request;
}

// A session of Xsens is named by its path.
Request recording_of(const Document& document, Verb verb) {
  Request request;
  request.verb = verb;
  request.dialect = Dialect::Recording;
  const std::string path = value_of(document.attributes, "SessionName");
  request.name = path.substr(path.find_last_of("/\\") + 1);
  return request;
}

// A value between double quotes.
std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&': safe += "&amp;"; break;
      case '<': safe += "&lt;"; break;
      case '>': safe += "&gt;"; break;
      case '"': safe += "&quot;"; break;
      case '\t': safe += "&#9;"; break;
      case '\n': safe += "&#10;"; break;
      case '\r': safe += "&#13;"; break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20) safe += c;  // XML 1.0 has no other control characters
    }
  }
  return safe;
}

std::string element(const char* name, std::string_view value) {
  return fmt::format(R"(<{} VALUE="{}"/>)", name, escaped(value));
}

}  // namespace

Result<Request> read_xml(std::string_view packet, bool xsens) {
  if (packet.size() > kMaxPacket_bytes) {
    return refusal(fmt::format("has {} bytes, expected at most {}", packet.size(), kMaxPacket_bytes));
  }
  const Result<Document> document = Reader().read(trimmed(packet));
  if (!document) return document.error();
  if (document->root == "CaptureStart") return capture_of(*document, Verb::Start, xsens);
  if (document->root == "CaptureStop") return capture_of(*document, Verb::Stop, xsens);
  if (document->root == "CaptureComplete") return capture_of(*document, Verb::Complete, xsens);
  if (document->root == "StartRecordingReq") return recording_of(*document, Verb::Start);
  if (document->root == "StopRecordingReq") return recording_of(*document, Verb::Stop);
  return refusal(
      fmt::format("is a '{}', expected CaptureStart, CaptureStop, CaptureComplete, StartRecordingReq or "
                  "StopRecordingReq",
                  document->root));
}

std::string write_capture(const CapturePacket& packet) {
  const bool starts = packet.verb == Verb::Start;
  const char* root = starts ? "CaptureStart" : packet.verb == Verb::Complete ? "CaptureComplete" : "CaptureStop";
  std::string text = fmt::format("{}<{}", kDeclaration, root);
  if (!starts) text += fmt::format(R"( RESULT="{}")", escaped(packet.result));
  text += '>';
  text += element("Name", packet.name);
  if (starts || !packet.notes.empty()) text += element("Notes", packet.notes);
  if (starts) text += element("Description", packet.description);
  text += element("DatabasePath", packet.database_path);
  const auto delay_ms = std::chrono::round<std::chrono::milliseconds>(packet.delay).count();
  text += element("Delay", fmt::format("{}", delay_ms));
  if (!packet.packet_id.empty()) text += element("PacketID", packet.packet_id);
  text += fmt::format("</{}>", root);
  text.push_back('\0');
  return text;
}

std::string write_ack(Verb verb, Dialect dialect, std::string_view reason) {
  const bool starts = verb == Verb::Start;
  const char* root = dialect == Dialect::Recording ? (starts ? "StartRecordingAck" : "StopRecordingAck")
                                                   : (starts ? "CaptureStartAck" : "CaptureStopAck");
  std::string text = reason.empty() ? fmt::format(R"(<{} Result="TRUE"/>)", root)
                                    : fmt::format(R"(<{} Result="FALSE" Reason="{}"/>)", root, escaped(reason));
  text.push_back('\0');
  return text;
}

}  // namespace mocap::trigger
