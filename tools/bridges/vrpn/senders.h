#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axes.h"
#include "bridges/vrpn/message.h"
#include "mocap_client.hpp"

namespace mocap::vrpn {

/// Which senders a server offers.
enum class Offer {
  Bones,   ///< each bone is a sender "SUBJECT/BONE" of one sensor
  Bodies,  ///< each subject is a sender "SUBJECT" whose sensors are its bones, by their index
  Both,
};

/// The report of one bone under one sender in one frame.
struct Report {
  std::int32_t sender = 0;
  bool repeated = false;  ///< the bone has a report under its own sender too
  std::string messages;   ///< pose, and velocity if the feed has velocities; each of sequence number 0
};

/// The senders that this server offers, and the reports of a frame under them. Pure.
///
/// A subject of one bone, a prop, is always a sender "SUBJECT" of one sensor. A sender keeps its number for ever, also
/// when its subject is no longer in the feed.
class Senders {
 public:
  /// VRPN's receivers have room for 2000 senders, some of which are their own.
  static constexpr std::size_t kMaxSenders = 1900;

  explicit Senders(Offer offer = Offer::Both) : offer_(offer) {}

  /// Adds the senders of the subjects of a frame. Returns whether there is a new one.
  bool add(const ClientFrame& frame);

  /// By number.
  const std::vector<std::string>& names() const { return names_; }
  std::optional<std::int32_t> find(std::string_view name) const;
  /// Bones that have no sender because their name is too long or there are too many senders.
  std::size_t refused() const { return refused_.size(); }

  /// The reports of all tracked subjects of a frame, which is in the axes of the feed, in the receivers' axes. A lost
  /// bone has none: VRPN has no flag for it. `unix_ns` is the time of exposure.
  std::vector<Report> report(const ClientFrame& frame, const client::Axes& axes, std::int64_t unix_ns) const;

 private:
  bool add_name(const std::string& name);
  void report_subject(const ClientSubject& subject, const client::Axes& axes, Stamp at,
                      std::vector<Report>& into) const;

  Offer offer_;
  std::vector<std::string> names_;
  std::map<std::string, std::int32_t, std::less<>> numbers_;
  std::map<std::string, bool, std::less<>> refused_;
};

}  // namespace mocap::vrpn
