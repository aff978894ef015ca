#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace mocap::fuzz {

/// Changes messages through their descriptors, so that each new field is tried without a change of a fuzzer.
class MessageFuzz {
 public:
  explicit MessageFuzz(std::mt19937_64& random) : random_(random) {}

  /// Sets fields at random, also within messages; lists are short.
  void fill(google::protobuf::Message& message, int depth = 0) {
    const auto& type = *message.GetDescriptor();
    for (int i = 0; i < type.real_oneof_decl_count(); ++i) {
      const auto& choice = *type.oneof_decl(i);
      set_perhaps(message, *choice.field(static_cast<int>(below(static_cast<std::size_t>(choice.field_count())))),
                  depth);
    }
    for (int i = 0; i < type.field_count(); ++i) {
      if (type.field(i)->real_containing_oneof() == nullptr) set_perhaps(message, *type.field(i), depth);
    }
  }

  /// Changes, clears or adds one field of the message or of a message within it.
  void damage(google::protobuf::Message& message) {
    std::vector<google::protobuf::Message*> all;
    collect(message, all);
    google::protobuf::Message& one = *all[below(all.size())];
    const auto& type = *one.GetDescriptor();
    if (type.field_count() == 0) return;
    const auto& field = *type.field(static_cast<int>(below(static_cast<std::size_t>(type.field_count()))));
    const auto& access = *one.GetReflection();
    switch (below(4)) {
      case 0: access.ClearField(&one, &field); break;
      case 1:
        if (field.is_repeated() && access.FieldSize(one, &field) > 0) {
          access.RemoveLast(&one, &field);
          break;
        }
        [[fallthrough]];
      default: change(one, field, 0);
    }
  }

 private:
  using Field = google::protobuf::FieldDescriptor;
  static constexpr int kDepth = 4;

  std::size_t below(std::size_t end) { return static_cast<std::size_t>(random_() % end); }
  static bool is_message(const Field& field) { return field.cpp_type() == Field::CPPTYPE_MESSAGE; }

  double number() {
    switch (below(8)) {
      case 0: return std::numeric_limits<double>::quiet_NaN();
      case 1: return HUGE_VAL;
      case 2: return -1e300;
      case 3: return 0.0;
      default: return static_cast<double>(below(2000)) * 0.01 - 5.0;
    }
  }

  std::int64_t integer() {
    switch (below(6)) {
      case 0: return static_cast<std::int64_t>(random_());
      case 1: return -1;
      default: return static_cast<std::int64_t>(below(9));
    }
  }

  std::string text() {
    switch (below(6)) {
      case 0: return {};
      case 1: return std::string(below(700), 'a');
      case 2: return std::string("\x01\n\xff\"'", 5);
      default: return std::string(1, static_cast<char>('a' + below(4)));
    }
  }

  void set_perhaps(google::protobuf::Message& message, const Field& field, int depth) {
    if (below(3) == 0 || (is_message(field) && depth >= kDepth)) return;
    change(message, field, depth);
  }

  // Sets one value, or adds some elements.
  void change(google::protobuf::Message& message, const Field& field, int depth) {
    for (std::size_t i = field.is_repeated() ? below(4) : 1; i > 0; --i) change_once(message, field, depth);
  }

  void change_once(google::protobuf::Message& message, const Field& field, int depth) {
    const auto& access = *message.GetReflection();
    const bool adds = field.is_repeated();
    const auto set = [&](auto setter, auto adder, auto value) {
      adds ? (access.*adder)(&message, &field, value) : (access.*setter)(&message, &field, value);
    };
    using Reflection = google::protobuf::Reflection;
    switch (field.cpp_type()) {
      case Field::CPPTYPE_BOOL: return set(&Reflection::SetBool, &Reflection::AddBool, below(2) == 0);
      case Field::CPPTYPE_ENUM:
        return set(&Reflection::SetEnumValue, &Reflection::AddEnumValue, static_cast<int>(below(20)));
      case Field::CPPTYPE_INT32:
        return set(&Reflection::SetInt32, &Reflection::AddInt32, static_cast<std::int32_t>(integer()));
      case Field::CPPTYPE_UINT32:
        return set(&Reflection::SetUInt32, &Reflection::AddUInt32, static_cast<std::uint32_t>(integer()));
      case Field::CPPTYPE_INT64: return set(&Reflection::SetInt64, &Reflection::AddInt64, integer());
      case Field::CPPTYPE_UINT64:
        return set(&Reflection::SetUInt64, &Reflection::AddUInt64, static_cast<std::uint64_t>(integer()));
      case Field::CPPTYPE_FLOAT: return set(&Reflection::SetFloat, &Reflection::AddFloat, static_cast<float>(number()));
      case Field::CPPTYPE_DOUBLE: return set(&Reflection::SetDouble, &Reflection::AddDouble, number());
      case Field::CPPTYPE_STRING:
        return adds ? access.AddString(&message, &field, text()) : access.SetString(&message, &field, text());
      case Field::CPPTYPE_MESSAGE:
        return fill(adds ? *access.AddMessage(&message, &field) : *access.MutableMessage(&message, &field), depth + 1);
    }
  }

  void collect(google::protobuf::Message& message, std::vector<google::protobuf::Message*>& into) {
    into.push_back(&message);
    const auto& access = *message.GetReflection();
    std::vector<const Field*> fields;
    access.ListFields(message, &fields);
    for (const Field* field : fields) {
      if (!is_message(*field)) continue;
      if (!field->is_repeated()) {
        collect(*access.MutableMessage(&message, field), into);
        continue;
      }
      for (int i = 0; i < access.FieldSize(message, field); ++i) {
        collect(*access.MutableRepeatedMessage(&message, field, i), into);
      }
    }
  }

  std::mt19937_64& random_;
};

}  // namespace mocap::fuzz
