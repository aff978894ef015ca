#include "web/foxglove/foxglove_channels.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <openssl/evp.h>

#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "web/foxglove/foxglove_messages.h"

namespace mocap::web {
namespace {

using google::protobuf::Descriptor;
using nlohmann::json;

std::string base64_of(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                      reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

void add_file(google::protobuf::FileDescriptorSet& all, const google::protobuf::FileDescriptor& file) {
  for (int i = 0; i < file.dependency_count(); ++i) add_file(all, *file.dependency(i));
  file.CopyTo(all.add_file());
}

// The definition of all messages, as the protocol wants it for the encoding "protobuf".
const std::string& schema() {
  static const std::string text = [] {
    google::protobuf::FileDescriptorSet all;
    add_file(all, *foxglove::SceneUpdate::descriptor()->file());
    return base64_of(all.SerializeAsString());
  }();
  return text;
}

const Descriptor& message_of(ChannelContent content) {
  switch (content) {
    case ChannelContent::Bones:
    case ChannelContent::Cameras: return *foxglove::FrameTransforms::descriptor();
    case ChannelContent::Image: return *foxglove::CompressedImage::descriptor();
    case ChannelContent::Scene: break;
  }
  return *foxglove::SceneUpdate::descriptor();
}

json offer_of(const Channel& channel) {
  return {{"id", channel.id},       {"topic", channel.topic},
          {"encoding", "protobuf"}, {"schemaName", message_of(channel.content).full_name()},
          {"schema", schema()},     {"schemaEncoding", "protobuf"}};
}

std::string text_of(const json& message) { return message.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

Channels::Channels() {
  for (Channel channel : {Channel{0, "/tf", ChannelContent::Bones, "snapshot", ""},
                          Channel{0, "/scene", ChannelContent::Scene, "snapshot", ""},
                          Channel{0, "/tf/cameras", ChannelContent::Cameras, "description", ""}}) {
    channel.id = id_of(channel.topic);
    channels_[channel.id] = channel;
  }
}

std::uint32_t Channels::id_of(const std::string& topic) {
  return ids_.try_emplace(topic, static_cast<std::uint32_t>(ids_.size() + 1)).first->second;
}

std::vector<std::string> Channels::update(const v1::Description& description) {
  std::set<std::string> cameras;
  json added = json::array();
  json removed = json::array();
  for (const v1::Camera& camera : description.cameras()) {
    cameras.insert(camera.name());
    const std::string topic = "/preview/" + camera.name();
    const Channel channel{id_of(topic), topic, ChannelContent::Image, topic.substr(1), camera.name()};
    if (channels_.try_emplace(channel.id, channel).second) added.push_back(offer_of(channel));
  }
  std::erase_if(channels_, [&](const auto& entry) {
    const bool gone = entry.second.content == ChannelContent::Image && !cameras.contains(entry.second.camera);
    if (gone) removed.push_back(entry.first);
    return gone;
  });
  std::vector<std::string> texts;
  if (!removed.empty()) texts.push_back(text_of({{"op", "unadvertise"}, {"channelIds", removed}}));
  if (!added.empty()) texts.push_back(text_of({{"op", "advertise"}, {"channels", added}}));
  return texts;
}

std::string Channels::advertisement() const {
  json all = json::array();
  for (const auto& [id, channel] : channels_) all.push_back(offer_of(channel));
  return text_of({{"op", "advertise"}, {"channels", all}});
}

const Channel* Channels::find(std::uint32_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

}  // namespace mocap::web
