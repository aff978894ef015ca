#include "take/snapshot_writer.h"

#include <fmt/core.h>

#include "take/output_file.h"
#include "wire/encode.h"
#include "wire/json.h"

namespace mocap::take {
namespace {

enum class Form { JsonLines, Protobuf };

class SnapshotWriter final : public Writer {
 public:
  SnapshotWriter(OutputFile file, Form form) : file_(std::move(file)), form_(form) {}

  Status write(const Snapshot& snapshot) override {
    wire::encode(snapshot, message_);
    if (form_ == Form::Protobuf) {
      message_.SerializeToString(&line_);
      return file_.append_delimited(line_);
    }
    line_ = wire::to_json_line(message_);
    line_ += '\n';
    return file_.append(line_);
  }

  Status finish() override { return file_.finish(); }

 private:
  OutputFile file_;
  Form form_;
  std::string line_;
  v1::Snapshot message_;
};

}  // namespace

Result<std::unique_ptr<Writer>> make_snapshot_writer(const std::filesystem::path& path) {
  const auto ending = path.extension();
  if (ending != ".jsonl" && ending != ".pb") {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("recording '{}': ends in '{}', expected .jsonl or .pb", path.string(), ending.string())};
  }
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  const Form form = ending == ".pb" ? Form::Protobuf : Form::JsonLines;
  return std::unique_ptr<Writer>(std::make_unique<SnapshotWriter>(std::move(*file), form));
}

}  // namespace mocap::take
