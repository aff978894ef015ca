#pragma once

#include <string>

#include "base/result.h"
#include "model/description.h"
#include "model/snapshot.h"
#include "module/recording_size.h"

namespace mocap {

/// Writes snapshots, or the fits of subjects, to a file.
///
/// The side thread owns a Writer and makes all calls.
class Writer {
 public:
  virtual ~Writer() = default;

  virtual Status write(const Snapshot& snapshot) = 0;

  /// A subject was fitted. The fit applies from the snapshot that has the description version of the fit.
  virtual Status learn(const SubjectFit& /*fit*/) { return {}; }

  /// The description changed. It applies from the snapshot that has its version.
  virtual Status describe(const Description& /*description*/) { return {}; }

  /// False if the writer needs only the fits.
  virtual bool wants_snapshots() const { return true; }

  /// Path of the recording; constant. Empty if the writer needs only the fits.
  virtual std::string path() const { return {}; }

  /// Size of the recording so far.
  virtual RecordingSize size() const { return {}; }

  /// Passes everything to the operating system and ends the file; `write` must not be called afterwards.
  virtual Status finish() = 0;
};

}  // namespace mocap
