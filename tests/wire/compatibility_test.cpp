// Compares the schema with the released schema (proto/baseline.binpb) and with the rules of Protobuf's style guide.
// After a release: protoc -I proto --include_imports --descriptor_set_out=proto/baseline.binpb proto/mocap/v1/*.proto
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mocap/v1/blobs.pb.h"
#include "mocap/v1/control.pb.h"
#include "mocap/v1/description.pb.h"
#include "mocap/v1/event.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/node.pb.h"
#include "mocap/v1/preview.pb.h"
#include "mocap/v1/sightings.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "mocap/v1/take.pb.h"
#include "support/places.h"

namespace mocap::wire {
namespace compatibility_test {

using google::protobuf::DescriptorProto;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FieldDescriptorProto;
using google::protobuf::FileDescriptorProto;
using google::protobuf::FileDescriptorSet;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// All messages and enums, including nested ones, by their full names.
struct Schema {
  std::map<std::string, DescriptorProto> messages;
  std::map<std::string, EnumDescriptorProto> enums;

  explicit Schema(const FileDescriptorSet& files) {
    for (const FileDescriptorProto& file : files.file()) {
      for (const auto& message : file.message_type()) add(file.package(), message);
      for (const auto& each : file.enum_type()) enums[file.package() + "." + each.name()] = each;
    }
  }
  void add(const std::string& scope, const DescriptorProto& message) {
    const std::string name = scope + "." + message.name();
    messages[name] = message;
    for (const auto& nested : message.nested_type()) add(name, nested);
    for (const auto& each : message.enum_type()) enums[name + "." + each.name()] = each;
  }
};

bool is_reserved(const DescriptorProto& message, int number) {
  for (const auto& range : message.reserved_range()) {
    if (number >= range.start() && number < range.end()) return true;
  }
  return false;
}

const FieldDescriptorProto* find(const DescriptorProto& message, int number) {
  for (const auto& field : message.field()) {
    if (field.number() == number) return &field;
  }
  return nullptr;
}

// Lists the changes from `before` to `now` that break a reader of `before` (binary or JSON).
std::vector<std::string> broken(const FileDescriptorSet& before, const FileDescriptorSet& now) {
  const Schema old_schema(before), new_schema(now);
  std::vector<std::string> all;
  for (const auto& [name, message] : old_schema.messages) {
    const auto found = new_schema.messages.find(name);
    if (found == new_schema.messages.end()) {
      all.push_back(name + " is gone");
      continue;
    }
    for (const auto& field : message.field()) {
      const FieldDescriptorProto* today = find(found->second, field.number());
      const std::string what = name + "." + field.name();
      if (today == nullptr) {
        if (!is_reserved(found->second, field.number())) all.push_back(what + " is gone and its number not reserved");
      } else if (today->name() != field.name() || today->type() != field.type() || today->label() != field.label() ||
                 today->type_name() != field.type_name() || today->proto3_optional() != field.proto3_optional()) {
        all.push_back(what + " is not what it was");
      }
    }
    for (const auto& range : message.reserved_range()) {
      for (int number = range.start(); number < range.end(); ++number) {
        if (!is_reserved(found->second, number)) all.push_back(name + ": a reserved number is free again");
      }
    }
  }
  for (const auto& [name, each] : old_schema.enums) {
    const auto found = new_schema.enums.find(name);
    std::map<int, std::string> values;
    if (found != new_schema.enums.end()) {
      for (const auto& value : found->second.value()) values[value.number()] = value.name();
    }
    for (const auto& value : each.value()) {
      if (values[value.number()] != value.name()) all.push_back(name + "." + value.name() + " is not what it was");
    }
  }
  return all;
}

FileDescriptorSet as_built() {
  FileDescriptorSet files;
  for (const auto* file :
       {v1::Description::descriptor()->file(), v1::Health::descriptor()->file(), v1::Snapshot::descriptor()->file(),
        v1::Event::descriptor()->file(), v1::Request::descriptor()->file(), v1::Preview::descriptor()->file(),
        v1::Sightings::descriptor()->file(), v1::BlobRecording::descriptor()->file(),
        v1::CameraBlobs::descriptor()->file(), v1::NodeMessage::descriptor()->file()}) {
    file->CopyTo(files.add_file());
  }
  return files;
}

FileDescriptorSet as_released() {
  std::ifstream in(support::source_folder() + "/proto/baseline.binpb", std::ios::binary);
  FileDescriptorSet files;
  EXPECT_TRUE(files.ParseFromIstream(&in));
  return files;
}

TEST(Schema, IsCompatibleWithTheReleasedSchema) { EXPECT_THAT(broken(as_released(), as_built()), IsEmpty()); }

TEST(Schema, DetectsABreakingChange) {
  const FileDescriptorSet released = as_released();
  const auto after = [&](const std::function<void(DescriptorProto&)>& change) {
    FileDescriptorSet changed = released;
    for (auto& file : *changed.mutable_file()) {
      for (auto& message : *file.mutable_message_type()) {
        if (message.name() == "Instants") change(message);
      }
    }
    return broken(released, changed);
  };

  EXPECT_THAT(after([](DescriptorProto& m) { m.mutable_field()->RemoveLast(); }),
              ElementsAre("mocap.v1.Instants.sent_at_ns is gone and its number not reserved"));
  EXPECT_THAT(after([](DescriptorProto& m) { m.mutable_field(0)->set_type(FieldDescriptorProto::TYPE_DOUBLE); }),
              ElementsAre("mocap.v1.Instants.exposed_at_ns is not what it was"));
  EXPECT_THAT(after([](DescriptorProto& m) { m.mutable_field(0)->set_name("shown_at_ns"); }),
              ElementsAre("mocap.v1.Instants.exposed_at_ns is not what it was"));
  EXPECT_THAT(after([](DescriptorProto& m) { m.mutable_field(0)->set_number(77); }),
              ElementsAre("mocap.v1.Instants.exposed_at_ns is gone and its number not reserved"));
  EXPECT_THAT(after([](DescriptorProto& m) {
                m.mutable_field()->RemoveLast();
                m.add_reserved_range()->set_start(5);
                m.mutable_reserved_range(0)->set_end(6);
              }),
              IsEmpty());
  EXPECT_THAT(after([](DescriptorProto& m) {
                FieldDescriptorProto& more = *m.add_field();
                more.set_name("later_ns");
                more.set_number(99);
              }),
              IsEmpty());
}

std::string upper_snake(const std::string& camel) {
  std::string text;
  for (const char c : camel) {
    if (c >= 'A' && c <= 'Z' && !text.empty()) text += '_';
    text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return text;
}

TEST(Schema, FollowsTheProtobufStyleGuide) {
  const Schema schema(as_built());
  for (const auto& [name, each] : schema.enums) {
    const std::string prefix = upper_snake(each.name()) + "_";
    EXPECT_EQ(each.value(0).number(), 0) << name;
    EXPECT_EQ(each.value(0).name(), prefix + "UNSPECIFIED") << name;
    for (const auto& value : each.value()) EXPECT_EQ(value.name().rfind(prefix, 0), 0U) << value.name();
  }
  for (const auto& [name, message] : schema.messages) {
    for (const auto& field : message.field()) {
      EXPECT_EQ(field.name().find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"), std::string::npos)
          << name << "." << field.name();
    }
  }
}

// The example in proto/README.md: its lines "OFFSET  HEX BYTES  explanation" together are one message of the feed.
TEST(Schema, HexDumpInTheReadmeIsAMessageOfTheFeed) {
  std::ifstream in(support::source_folder() + "/proto/README.md");
  std::string bytes;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("```hex", 0) == 0) inside = true;
    if (line == "```") inside = false;
    if (!inside || line.size() < 6 || line.rfind("```", 0) == 0) continue;
    ASSERT_EQ(std::stoul(line.substr(0, 4), nullptr, 16), bytes.size()) << line;
    const std::string hex = line.substr(6, line.find("  ", 6) - 6);
    for (std::size_t i = 0; i + 1 < hex.size(); i += 3) {
      bytes += static_cast<char>(std::stoul(hex.substr(i, 2), nullptr, 16));
    }
  }

  const std::string topic("snapshot\0", 9);
  ASSERT_EQ(bytes.substr(0, topic.size()), topic);
  v1::Snapshot snapshot;
  ASSERT_TRUE(snapshot.ParseFromString(bytes.substr(topic.size())));
  EXPECT_EQ(snapshot.number(), 300U);
  EXPECT_EQ(snapshot.sequence(), 299U);
  EXPECT_EQ(snapshot.description_version(), 1U);
  EXPECT_EQ(snapshot.instants().exposed_at_ns(), 1'000'000'000);
  ASSERT_EQ(snapshot.subjects_size(), 1);
  EXPECT_EQ(snapshot.subjects(0).phase(), v1::SUBJECT_PHASE_TRACKING);
  EXPECT_THAT(snapshot.subjects(0).markers().states(), ElementsAre(v1::MARKER_STATE_MEASURED, v1::MARKER_STATE_LOST));
  EXPECT_THAT(snapshot.subjects(0).markers().positions_m(), ElementsAre(0.5F, -0.25F, 1.5F, 0.0F, 0.0F, 0.0F));
  EXPECT_THAT(snapshot.subjects(0).markers().residuals_millipx(), ElementsAre(120U, 0U));
}

}  // namespace compatibility_test
}  // namespace mocap::wire
