#include "take/recordings/record_settings.h"

#include <fmt/format.h>

namespace mocap::take {

void declare_keys(KeyVisitor& keys, RecordSettings& record) {
  keys.path("snapshots", record.snapshots,
            {.help = "file for every snapshot, .jsonl (text) or .pb (Protobuf); \"\": none; an existing file is kept: "
                     "the new one is NAME-2.jsonl"});
  keys.path("blobs", record.blobs,
            {.help = "file for the blobs of every camera, .blobs, for mocap-calibrate; \"\": none; an existing file is "
                     "kept: the new one is NAME-2.blobs"});
}

std::vector<KeyFault> faults_of(const RecordSettings& record) {
  std::vector<KeyFault> faults;
  const std::filesystem::path& file = record.snapshots;
  if (!file.empty() && file.extension() != ".jsonl" && file.extension() != ".pb") {
    faults.push_back({"snapshots", fmt::format("snapshots is '{}', expected a file name that ends in .jsonl or .pb",
                                               file.string())});
  }
  const std::filesystem::path& blobs = record.blobs;
  if (!blobs.empty() && blobs.extension() != ".blobs") {
    faults.push_back({"blobs", fmt::format("blobs is '{}', expected a file name that ends in .blobs", blobs.string())});
  }
  return faults;
}

}  // namespace mocap::take
