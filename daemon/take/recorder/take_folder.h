#pragma once

#include <string>

#include "base/result.h"
#include "base/time.h"
#include "model/take/take_order.h"
#include "take/take_name.h"
#include "take/takes_settings.h"

namespace mocap::take {

/// [takes] folder: which takes it has, the names of the next ones, and its free space. Each function looks at the disk.
class TakeFolder {
 public:
  /// The settings outlive the TakeFolder.
  explicit TakeFolder(const TakesSettings& settings) : settings_(settings) {}

  /// Fails with InvalidArgument if an order to start has an unusable name or slate, too long notes, the name of a
  /// take that exists, or begins earlier than the memory reaches.
  Status check_order(const TakeOrder& order) const;
  /// Makes the folder. Fails with Io, also if too little space is free.
  Status prepare() const;
  /// Fails with Io if less than min_free_mb is free.
  Status check_space() const;

  /// The name of the take of an order; `utc`: time since 1970.
  TakeName name_for(const TakeOrder& order, const std::string& slate, Duration utc) const;
  /// The order with what the shot says. A name that a take has already gets a number: a list may be used again.
  TakeOrder with_shot(TakeOrder order, const Shot& shot) const;

 private:
  const TakesSettings& settings_;
};

/// Fails with Io if no file has this path any more: if the file or its folder was removed while a take is written, the
/// data are lost when the file is closed.
Status check_file(const std::string& path);

}  // namespace mocap::take
