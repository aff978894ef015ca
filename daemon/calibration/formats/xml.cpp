#include <fmt/format.h>

#include <array>
#include <cctype>

#include "calibration/formats/format_reader.h"

namespace mocap::calibration {
namespace {

constexpr int kMaxXmlDepth = 32;

/// A recursive-descent parser; stops at the first fault.
class XmlParser {
 public:
  explicit XmlParser(const std::string& text) : text_(text) {}

  bool parse(XmlElement& root) {
    if (text_.starts_with("\xef\xbb\xbf")) at_ = 3;
    return skip_to_element() && element(root, 0) && end_of_file();
  }
  const std::string& fault() const { return fault_; }

  TextPlace place() const {
    TextPlace place{1, 1};
    for (std::size_t i = 0; i < at_ && i < text_.size(); ++i) {
      place.column = text_[i] == '\n' ? 1 : place.column + 1;
      place.line += text_[i] == '\n' ? 1 : 0;
    }
    return place;
  }

 private:
  bool fail(std::string what) {
    if (fault_.empty()) fault_ = std::move(what);
    return false;
  }
  bool sees(const char* word) const { return text_.compare(at_, std::char_traits<char>::length(word), word) == 0; }
  bool more() const { return at_ < text_.size(); }

  bool skip_over(const char* end) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string::npos) return fail(fmt::format("ends before '{}'", end));
    at_ = found + std::char_traits<char>::length(end);
    return true;
  }

  // Skips text, comments and the declaration: moves to the '<' of the next opening or closing tag, or to the end.
  bool skip_to_element() {
    while (true) {
      at_ = std::min(text_.find('<', at_), text_.size());
      if (!more()) return true;
      if (sees("<!--")) {
        if (!skip_over("-->")) return false;
      } else if (sees("<?")) {
        if (!skip_over("?>")) return false;
      } else if (sees("<!")) {
        return fail("has a DTD or CDATA, expected elements and attributes only");
      } else {
        return true;
      }
    }
  }

  std::string name() {
    const std::size_t begin = at_;
    while (more() && (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_' ||
                      text_[at_] == '-' || text_[at_] == ':' || text_[at_] == '.')) {
      ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }

  void blanks() {
    while (more() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }

  static std::string plain(const std::string& raw) {
    constexpr std::array<std::pair<const char*, char>, 5> kEntities{
        {{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}}};
    std::string text;
    for (std::size_t i = 0; i < raw.size();) {
      bool found = false;
      for (const auto& [entity, character] : kEntities) {
        const std::size_t length = std::char_traits<char>::length(entity);
        if (found || raw.compare(i, length, entity) != 0) continue;
        text += character;
        i += length;
        found = true;
      }
      if (!found) text += raw[i++];
    }
    return text;
  }

  bool attribute(XmlElement& element) {
    const std::string key = name();
    if (key.empty()) return fail(fmt::format("has in <{}> a character that cannot begin an attribute", element.name));
    blanks();
    if (!more() || text_[at_] != '=')
      return fail(fmt::format("has no value for the attribute '{}', expected =\"...\"", key));
    ++at_;
    blanks();
    if (!more() || (text_[at_] != '"' && text_[at_] != '\''))
      return fail(fmt::format("has no quotes around the value of '{}'", key));
    const char quote = text_[at_++];
    const std::size_t end = text_.find(quote, at_);
    if (end == std::string::npos) return fail(fmt::format("never closes the quotes of '{}'", key));
    element.attributes.emplace_back(key, plain(text_.substr(at_, end - at_)));
    at_ = end + 1;
    return true;
  }

  bool element(XmlElement& element, int depth) {
    if (depth > kMaxXmlDepth) return fail("is deeper than a calibration can be");
    if (!more() || text_[at_] != '<') return fail("has no XML element");
    element.at = place();
    ++at_;
    element.name = name();
    if (element.name.empty()) return fail("has a '<' without an element name");
    while (true) {
      blanks();
      if (!more()) return fail(fmt::format("ends within <{}>", element.name));
      if (sees("/>")) {
        at_ += 2;
        return true;
      }
      if (text_[at_] == '>') break;
      if (!attribute(element)) return false;
    }
    ++at_;
    return children(element, depth);
  }

  bool children(XmlElement& element, int depth) {
    while (skip_to_element()) {
      if (!more()) return fail(fmt::format("ends before </{}>", element.name));
      if (!sees("</")) {
        element.children.emplace_back();
        if (!this->element(element.children.back(), depth + 1)) return false;
        continue;
      }
      at_ += 2;
      const std::string closed = name();
      blanks();
      if (closed != element.name || !more() || text_[at_] != '>') {
        return fail(fmt::format("has </{}> where <{}> ends", closed, element.name));
      }
      ++at_;
      return true;
    }
    return false;
  }

  bool end_of_file() { return skip_to_element() && (!more() || fail("continues after its root element")); }

  const std::string& text_;
  std::size_t at_ = 0;
  std::string fault_;
};

}  // namespace

const std::string* XmlElement::attribute(const std::string& key) const {
  for (const auto& [each, value] : attributes) {
    if (each == key) return &value;
  }
  return nullptr;
}

const XmlElement* XmlElement::child(const std::string& key) const {
  for (const XmlElement& each : children) {
    if (each.name == key) return &each;
  }
  return nullptr;
}

Result<XmlElement, FormatFaults> parse_xml(const std::string& text) {
  XmlElement root;
  XmlParser parser(text);
  if (parser.parse(root)) return root;
  const TextPlace at = parser.place();
  return FormatFaults{{at.line, at.column, "is not readable XML: it " + parser.fault()}};
}

}  // namespace mocap::calibration
