#include "export/fbx_node.h"

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "base/expects.h"

namespace mocap::exports {
namespace {

static_assert(std::endian::native == std::endian::little, "FBX and this writer are little-endian");

using namespace std::string_view_literals;

constexpr auto kHeader = "Kaydara FBX Binary  \0\x1a\0"sv;
// Identity and footer of the creation time 1970-01-01 10:00:00:000, and the constant that ends each file. Source: the
// specification of Blender (see the header).
constexpr auto kFileId = "\x28\xb3\x2a\xeb\xb6\x24\xcc\xc2\xbf\xc8\xb0\x2a\xa9\x2b\xfc\xf1"sv;
constexpr auto kFooterId = "\xfa\xbc\xab\x09\xd0\xc8\xd4\x66\xb1\x76\xfb\x83\x1c\xf7\x26\x7e"sv;
constexpr auto kEnd = "\xf8\x5a\x8c\x6a\xde\xf5\xd9\x7e\xec\xe9\x0c\xe3\x75\x8f\x29\x0b"sv;

// End offset, number of properties, length of the properties, length of the name.
constexpr std::size_t kRecordHead = 13;
// A record with nested records ends with an empty record head.
constexpr std::size_t kNullRecord = 13;

template <class Value>
void append(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::uint32_t narrow(std::size_t size) {
  MOCAP_EXPECTS(size <= std::numeric_limits<std::uint32_t>::max());
  return static_cast<std::uint32_t>(size);
}

}  // namespace

void FbxNode::add_type(char type) {
  ++property_count_;
  properties_ += type;
}

template <class Value>
FbxNode& FbxNode::add_value(char type, const Value& value) {
  add_type(type);
  append(properties_, value);
  return *this;
}

// An array: number of elements, encoding (0: not compressed), number of bytes, elements.
template <class Value>
FbxNode& FbxNode::add_array(char type, std::span<const Value> values) {
  add_type(type);
  append(properties_, narrow(values.size()));
  append(properties_, std::uint32_t{0});
  append(properties_, narrow(values.size_bytes()));
  properties_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return *this;
}

FbxNode& FbxNode::add(bool value) { return add_value('C', static_cast<char>(value ? 1 : 0)); }
FbxNode& FbxNode::add(std::int32_t value) { return add_value('I', value); }
FbxNode& FbxNode::add(std::int64_t value) { return add_value('L', value); }
FbxNode& FbxNode::add(double value) { return add_value('D', value); }
FbxNode& FbxNode::add(std::span<const std::int32_t> values) { return add_array('i', values); }
FbxNode& FbxNode::add(std::span<const std::int64_t> values) { return add_array('l', values); }
FbxNode& FbxNode::add(std::span<const float> values) { return add_array('f', values); }
FbxNode& FbxNode::add(std::span<const double> values) { return add_array('d', values); }

FbxNode& FbxNode::add(std::string_view text) {
  add_value('S', narrow(text.size()));
  properties_ += text;
  return *this;
}

FbxNode& FbxNode::add_raw(std::string_view bytes) {
  add_value('R', narrow(bytes.size()));
  properties_ += bytes;
  return *this;
}

FbxNode& FbxNode::child(FbxNode node) {
  children_.push_back(std::move(node));
  return children_.back();
}

std::size_t FbxNode::size_bound() const {
  std::size_t bytes = kRecordHead + name_.size() + properties_.size() + kNullRecord;
  for (const FbxNode& node : children_) {
    bytes += node.size_bound();
  }
  return bytes;
}

void FbxNode::append_to(std::string& file) const {
  const std::size_t start = file.size();
  append(file, std::uint32_t{0});  // the end, which is known below
  append(file, property_count_);
  append(file, narrow(properties_.size()));
  append(file, static_cast<std::uint8_t>(name_.size()));
  file += name_;
  file += properties_;
  for (const FbxNode& node : children_) {
    node.append_to(file);
  }
  if (!children_.empty() || property_count_ == 0) {
    file.append(kNullRecord, '\0');
  }
  const std::uint32_t end = narrow(file.size());
  std::memcpy(file.data() + start, &end, sizeof end);
}

std::string_view fbx_file_id() { return kFileId; }

std::string fbx_file(std::span<const FbxNode> records) {
  std::string file(kHeader);
  append(file, static_cast<std::uint32_t>(kFbxVersion));
  for (const FbxNode& record : records) {
    record.append_to(file);
  }
  file.append(kNullRecord, '\0');
  file += kFooterId;
  file.append(4, '\0');
  file.append(16 - file.size() % 16, '\0');  // 1 to 16 bytes: the rest of the footer is aligned
  append(file, static_cast<std::uint32_t>(kFbxVersion));
  file.append(120, '\0');
  file += kEnd;
  return file;
}

}  // namespace mocap::exports
