#include "take/recordings/snapshot_writer.h"

#include <fmt/core.h>

#include <deque>

#include "take/recordings/output_file.h"
#include "wire/codec/encode.h"
#include "wire/codec/json.h"

namespace mocap::take {
namespace {

enum class Form { JsonLines, Protobuf };

class SnapshotWriter final : public Writer {
 public:
  SnapshotWriter(OutputFile file, Form form, Description description)
      : file_(std::move(file)), form_(form), description_(std::move(description)) {}

  Status learn(const SubjectFit& fit) override {
    return describe(with_fit(pending_.empty() ? description_ : pending_.back(), fit));
  }

  Status describe(const Description& description) override {
    pending_.push_back(description);
    return {};
  }

  Status write(const Snapshot& snapshot) override {
    use_description(snapshot.description_version);
    wire::encode(snapshot, message_);
    if (!described_) *message_.mutable_description() = wire::encode(description_);
    described_ = true;
    if (form_ == Form::Protobuf) {
      message_.SerializeToString(&line_);
      return file_.append_delimited(line_);
    }
    line_ = wire::to_json_line(message_);
    line_ += '\n';
    return file_.append(line_);
  }

  std::string path() const override { return file_.path(); }
  RecordingSize size() const override { return file_.size(); }
  Status finish() override { return file_.finish(); }

 private:
  // Uses the description of `version`: a description may arrive before the last snapshots of the one before.
  void use_description(std::uint32_t version) {
    while (!pending_.empty() && pending_.front().version <= version) {
      description_ = std::move(pending_.front());
      pending_.pop_front();
      described_ = false;
    }
  }

  OutputFile file_;
  Form form_;
  Description description_;
  bool described_ = false;  // description_ is in the file
  std::deque<Description> pending_;
  std::string line_;
  v1::Snapshot message_;
};

}  // namespace

Result<std::unique_ptr<Writer>> make_snapshot_writer(const std::filesystem::path& path, Description description) {
  const auto ending = path.extension();
  if (ending != ".jsonl" && ending != ".pb") {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("recording '{}': ends in '{}', expected .jsonl or .pb", path.string(), ending.string())};
  }
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  const Form form = ending == ".pb" ? Form::Protobuf : Form::JsonLines;
  return std::unique_ptr<Writer>(std::make_unique<SnapshotWriter>(std::move(*file), form, std::move(description)));
}

}  // namespace mocap::take
