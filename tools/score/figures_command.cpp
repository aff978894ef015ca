// mocap-score labels and mocap-score skeleton: score a stream against the truth. Both are files of JSON lines.
#include <fmt/core.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "base/exit_codes.h"
#include "lib/cli/app.h"
#include "lib/scoring/figures.h"
#include "lib/scoring/truth.h"
#include "score/command.h"
#include "score/plots.h"

namespace mocap::score {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kLabelsHelp =
    "A measured label of the stream is right if it lies within 20 mm of its own marker and no other marker is\n"
    "less than half as far; otherwise it is wrong. precision: share of right labels among these. recall: share\n"
    "of the markers seen by at least two cameras in the truth that have the right label. Scoring begins with a\n"
    "subject's first label. wrong_events: runs of consecutive sets in which one label is wrong;\n"
    "longest_wrong_sets: the longest run. availability: share of the sets with a visible marker in which the\n"
    "subject is tracked with a complete skeleton. reacquire_s: after at least 0.1 s without a visible marker,\n"
    "time until 90 % of the visible markers have the right label and no label is wrong; 95th percentile.\n"
    "ghosts: unlabelled points over 50 mm from all lights of the truth. mota, motp_mm and their counts:\n"
    "CLEAR-MOT over the labels, gate 20 mm. Filled labels are counted separately.\n"
    "\n"
    "examples:\n"
    "  mocap-score labels --truth truth.jsonl --stream stream.jsonl\n"
    "  mocap-watch --json --seconds 10 | mocap-score labels --truth truth.jsonl --stream - --json\n";
constexpr const char* kSkeletonHelp =
    "joint_rms_mm and rotation_rms_deg: world errors of all bones, over the sets in which the stream has a\n"
    "pose. jitter_mm: standard deviation, each axis, of the white noise that has the same second difference\n"
    "over three sets as the joint errors. hidden_joint_rms_mm: bones that are filled in the truth, because no\n"
    "marker is visible.\n"
    "\n"
    "examples:\n"
    "  mocap-score skeleton --truth truth.jsonl --stream stream.jsonl\n"
    "  mocap-score skeleton --truth truth.jsonl --stream stream.jsonl --plots plots\n";

struct FiguresOptions {
  std::string truth, stream, plots;
  bool json = false;
};

struct Judged {
  scoring::LabelScorer labels;
  scoring::SkeletonScorer bones;
  std::map<std::uint32_t, scoring::LabelCounts> names;
  std::uint64_t without_truth = 0;
};

int fail_figures(const Error& error) {
  fmt::print(stderr, "mocap-score: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitData : kExitNoInput;
}

Result<Judged> judge(const FiguresOptions& options) {
  Result<std::vector<scoring::EvalFrame>> known = scoring::read_frames(options.truth);
  if (!known) return known.error();
  const Result<scoring::Truth> truth = scoring::Truth::of(std::move(*known));
  if (!truth) return Error{truth.error().code, options.truth + ": " + truth.error().message};
  const Result<std::vector<scoring::EvalFrame>> stream = scoring::read_frames(options.stream);
  if (!stream) return stream.error();
  const bool keeps = !options.plots.empty();
  Judged judged{scoring::LabelScorer(keeps), scoring::SkeletonScorer(keeps), {}, 0};
  for (const scoring::EvalFrame& reported : *stream) {
    const auto true_frame = truth->at(reported.exposed_at);
    if (!true_frame) {
      ++judged.without_truth;
      continue;
    }
    judged.labels.add(*true_frame, reported);
    judged.bones.add(*true_frame, reported);
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

Status draw(const FiguresOptions& options, const Judged& judged, bool names) {
  if (options.plots.empty()) return {};
  std::error_code error;
  fs::create_directories(options.plots, error);
  const fs::path folder = options.plots;
  for (const auto& [id, timeline] : judged.labels.timelines()) {
    if (!names) break;
    const Status drawn =
        plot_names(folder / fmt::format("names_{}.svg", id), fmt::format("labels of subject {}", id), timeline, {});
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
  FiguresOptions options;
  cli::App app(names ? "Scores the labels of a stream." : "Scores the bones of a stream.",
               names ? "mocap-score labels" : "mocap-score skeleton");
  app.add_option("--truth", options.truth, "truth, JSON lines")->required();
  app.add_option("--stream", options.stream, "stream, JSON lines (mocap-watch --json); -: standard input")->required();
  app.add_option("--plots", options.plots, "write plots over time to this folder, one file for each subject");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(names ? kLabelsHelp : kSkeletonHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  auto judged = judge(options);
  if (!judged) return fail_figures(judged.error());
  Json object = names ? with_subjects(judged->names) : with_subjects(judged->bones.counts());
  if (names) {
    scoring::put(object, judged->labels.mot());
    object["unlabelled"] = judged->labels.unlabelled();
    object["ghosts"] = judged->labels.ghosts();
  }
  object["frames_without_truth"] = judged->without_truth;
  print(object, options.json);
  const Status drawn = draw(options, *judged, names);
  return drawn ? kExitOk : fail_figures(drawn.error());
}

}  // namespace

int run_labels(int argc, const char* const* argv) { return run(argc, argv, true); }
int run_skeleton(int argc, const char* const* argv) { return run(argc, argv, false); }

}  // namespace mocap::score
