#include "chaos/virtual_subscriber.h"

#include "wire/codec/decode.h"

namespace mocap::chaos {

void VirtualSubscriber::note(const Finding& finding) {
  if (!finding_) finding_ = finding;
}

void VirtualSubscriber::refuse(bool damaged, const std::string& why) {
  if (!damaged) note(why);
}

void VirtualSubscriber::receive_description(const std::string& bytes, bool damaged) {
  v1::Description message;
  if (!message.ParseFromString(bytes)) return refuse(damaged, "a description cannot be parsed");
  const Result<Description> read = wire::decode(message);
  if (!read) return refuse(damaged, read.error().message);
  if (!damaged) known_ = *read;
}

void VirtualSubscriber::receive_snapshot(const std::string& bytes, bool damaged) {
  v1::Snapshot message;
  if (!message.ParseFromString(bytes)) return refuse(damaged, "a snapshot cannot be parsed");
  const Result<Snapshot> read = wire::decode(message);
  if (!read) return refuse(damaged, read.error().message);
  if (damaged || !known_) return;
  ++read_snapshots_;
  note(fits_description(*read, *known_));
}

}  // namespace mocap::chaos
