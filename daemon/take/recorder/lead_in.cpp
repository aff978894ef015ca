#include "take/recorder/lead_in.h"

#include <utility>

namespace mocap::take {

void LeadIn::add(const BufferedMessage& message) {
  switch (message.kind) {
    case BufferedKind::Blobs: images_.push_back({message.at, std::string(message.bytes)}); return;
    case BufferedKind::Snapshot: sets_.push_back({message.at, std::string(message.bytes)}); return;
    case BufferedKind::Belief: return begin(message);
    case BufferedKind::Description:
    case BufferedKind::Health:
    case BufferedKind::Event:
    case BufferedKind::Break: return;
  }
}

// A later belief makes an earlier one needless, with the sets before it.
void LeadIn::begin(const BufferedMessage& belief) {
  v1::Belief read;
  if (!read.ParseFromArray(belief.bytes.data(), static_cast<int>(belief.bytes.size()))) return;
  belief_ = std::move(read);
  std::erase_if(sets_, [&](const Waiting& set) { return set.at <= belief.at; });
  std::erase_if(images_, [&](const Waiting& image) { return image.at < belief.at - kLongestSet; });
}

std::optional<std::string> LeadIn::finish(const std::string& producer) {
  if (!belief_) return std::nullopt;
  belief_->set_producer(producer);
  for (const Waiting& set : sets_) belief_->add_sets()->ParseFromString(set.bytes);
  for (const Waiting& image : images_) belief_->add_images()->ParseFromString(image.bytes);
  return belief_->SerializeAsString();
}

}  // namespace mocap::take
