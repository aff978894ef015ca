// mocap-eval labels and mocap-eval skeleton: a stream against the truth, both as JSON lines.
#include <fmt/core.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "eval/plots.h"
#include "lib/cli/app.h"
#include "lib/scoring/figures.h"
#include "lib/scoring/truth.h"

namespace mocap::eval {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kBadData = 65;  // sysexits EX_DATAERR
constexpr int kNoInput = 66;  // sysexits EX_NOINPUT

constexpr const char* kLabelsHelp =
    "A name that the stream shows as measured is right within 20 mm of its own marker, unless another marker is less\n"
    "than half as far; otherwise it is wrong. precision: right of all such names. recall: of the markers that two\n"
    "cameras see in the truth, those with their right names. Judged are the sets from a subject's first name on.\n"
    "wrong_events: runs of consecutive sets in which one name is wrong; longest_wrong_sets: the longest of them.\n"
    "availability: share of the sets with a marker in view in which the subject is tracked with a whole skeleton.\n"
    "reacquire_s: after nothing of it was in view for 0.1 s, until 90 % of the markers in view bear their names and\n"
    "none a wrong one; 95th percentile. ghosts: nameless points over 50 mm from all lights of the truth. mota,\n"
    "motp_mm and the counts beside them are CLEAR-MOT over the names, within 20 mm. filled names stand apart.\n";
constexpr const char* kSkeletonHelp =
    "Of all bones of the sets in which the stream has a pose: joint_rms_mm and rotation_rms_deg in the world; "
    "jitter_mm\n"
    "is the white noise, each axis, that has the second difference over three sets which the joints' errors have;\n"
    "hidden_joint_rms_mm is of the bones that the truth calls filled: none of their own markers is in view.\n";

struct Options {
  std::string truth, stream, plots;
  bool json = false;
};

struct Judged {
  scoring::LabelScorer labels;
  scoring::SkeletonScorer bones;
  std::map<std::uint32_t, scoring::LabelCounts> names;
  std::uint64_t without_truth = 0;
};

int fail(const Error& error) {
  fmt::print(stderr, "mocap-eval: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kBadData : kNoInput;
}

Result<Judged> judge(const Options& options) {
  Result<std::vector<scoring::EvalFrame>> known = scoring::read_frames(options.truth);
  if (!known) return known.error();
  const Result<scoring::Truth> truth = scoring::Truth::of(std::move(*known));
  if (!truth) return Error{truth.error().code, options.truth + ": " + truth.error().message};
  const Result<std::vector<scoring::EvalFrame>> stream = scoring::read_frames(options.stream);
  if (!stream) return stream.error();
  const bool keeps = !options.plots.empty();
  Judged judged{scoring::LabelScorer(keeps), scoring::SkeletonScorer(keeps), {}, 0};
  for (const scoring::EvalFrame& said : *stream) {
    const auto true_frame = truth->at(said.exposed_at);
    if (!true_frame) {
      ++judged.without_truth;
      continue;
    }
    judged.labels.add(*true_frame, said);
    judged.bones.add(*true_frame, said);
  }
  judged.names = judged.labels.finish();
  return judged;
}

template <class Counts>
Json with_subjects(const std::map<std::uint32_t, Counts>& by_subject) {
  Json object;
  Counts all;
  for (const auto& [id, counts] : by_subject) all.add(counts);
  scoring::put(object, all);
  object["subjects"] = Json::array();
  for (const auto& [id, counts] : by_subject) {
    Json subject{{"subject", id}};
    scoring::put(subject, counts);
    object["subjects"].push_back(std::move(subject));
  }
  return object;
}

Status draw(const Options& options, const Judged& judged, bool names) {
  if (options.plots.empty()) return {};
  std::error_code error;
  fs::create_directories(options.plots, error);
  const fs::path folder = options.plots;
  for (const auto& [id, timeline] : judged.labels.timelines()) {
    if (!names) break;
    const Status drawn =
        plot_names(folder / fmt::format("names_{}.svg", id), fmt::format("names of subject {}", id), timeline, {});
    if (!drawn) return drawn;
  }
  for (const auto& [id, errors] : judged.bones.errors()) {
    if (names) break;
    const Status drawn =
        plot_errors(folder / fmt::format("joints_{}.svg", id), fmt::format("joints of subject {}", id), errors);
    if (!drawn) return drawn;
  }
  return {};
}

void print(const Json& object, bool json) {
  if (json) {
    fmt::print("{}\n", object.dump());
    return;
  }
  for (const auto& [key, value] : object.items()) {
    if (key != "subjects") fmt::print("{:<22} {}\n", key, value.is_null() ? "-" : value.dump());
  }
  for (const Json& subject : object.at("subjects")) {
    if (object.at("subjects").size() == 1) break;
    for (const auto& [key, value] : subject.items()) {
      fmt::print("  {:<22} {}\n", key, value.is_null() ? "-" : value.dump());
    }
  }
}

int run(int argc, const char* const* argv, bool names) {
  Options options;
  cli::App app(names ? "How right are the names of a stream?" : "How right are the bones of a stream?",
               names ? "mocap-eval labels" : "mocap-eval skeleton");
  app.add_option("--truth", options.truth, "JSON lines of the truth")->required();
  app.add_option("--stream", options.stream, "JSON lines of the stream (mocap-watch --json); -: standard input")
      ->required();
  app.add_option("--plots", options.plots, "draw it over time into this folder, a file a subject");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(names ? kLabelsHelp : kSkeletonHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  auto judged = judge(options);
  if (!judged) return fail(judged.error());
  Json object = names ? with_subjects(judged->names) : with_subjects(judged->bones.counts());
  if (names) {
    scoring::put(object, judged->labels.mot());
    object["unlabelled"] = judged->labels.unlabelled();
    object["ghosts"] = judged->labels.ghosts();
  }
  object["frames_without_truth"] = judged->without_truth;
  print(object, options.json);
  const Status drawn = draw(options, *judged, names);
  return drawn ? kExitOk : fail(drawn.error());
}

}  // namespace

int run_labels(int argc, const char* const* argv) { return run(argc, argv, true); }
int run_skeleton(int argc, const char* const* argv) { return run(argc, argv, false); }

}  // namespace mocap::eval
