#include "take/take_schemas.h"

#include <google/protobuf/descriptor.pb.h>

#include <set>

namespace mocap::take {
namespace {

void add(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
         google::protobuf::FileDescriptorSet& set) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add(*file.dependency(i), added, set);
  file.CopyTo(set.add_file());
}

}  // namespace

std::string schema_of(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> added;
  add(*message.file(), added, set);
  return set.SerializeAsString();
}

}  // namespace mocap::take
