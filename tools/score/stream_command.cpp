#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>

#include "base/exit_codes.h"
#include "lib/cli/app.h"
#include "lib/scoring/score.h"
#include "score/command.h"

namespace mocap::score {
namespace {

constexpr int kNotMet = 1;

// Limits on the figures of the stream. An absent limit is not checked.
struct Demands {
  std::optional<std::uint64_t> min_frames;
  std::optional<double> min_complete_share;
  std::optional<double> min_right_share;
  std::optional<std::uint64_t> max_label_errors;
  std::optional<double> max_marker_rms_mm;
  std::optional<double> max_joint_rms_mm;
};

// The limits of --require-match: at least a second of labelled skeletons that match the truth.
Demands filled_up(Demands demands) {
  demands.min_frames = demands.min_frames.value_or(60);
  demands.min_right_share = demands.min_right_share.value_or(0.95);
  demands.max_label_errors = demands.max_label_errors.value_or(0);
  demands.max_marker_rms_mm = demands.max_marker_rms_mm.value_or(2.0);
  demands.max_joint_rms_mm = demands.max_joint_rms_mm.value_or(50.0);
  return demands;
}

struct StreamOptions {
  std::string truth;
  std::string stream;
  scoring::ScoreSettings settings;
  Demands demands;
  bool require_match = false;
  bool json = false;
};

// An absent figure meets no limit.
template <class Figure, class Bound>
bool at_most(const char* what, const std::optional<Figure>& figure, const std::optional<Bound>& bound) {
  if (!bound || (figure && *figure <= *bound)) return true;
  fmt::print(stderr, "mocap-score: {} is {}, at most {} is asked for\n", what,
             figure ? fmt::format("{}", *figure) : "not known", *bound);
  return false;
}

template <class Figure, class Bound>
bool at_least(const char* what, const std::optional<Figure>& figure, const std::optional<Bound>& bound) {
  if (!bound || (figure && *figure >= *bound)) return true;
  fmt::print(stderr, "mocap-score: {} is {}, at least {} is asked for\n", what,
             figure ? fmt::format("{}", *figure) : "not known", *bound);
  return false;
}

bool meets(const scoring::Score& s, const Demands& demands) {
  std::optional<double> right_share;
  if (s.labels_expected > 0) right_share = static_cast<double>(s.labels_right) / static_cast<double>(s.labels_expected);
  const bool met[] = {
      at_least("frames", std::optional(s.frames), demands.min_frames),
      at_least("complete_share", s.complete_share, demands.min_complete_share),
      at_least("labels_right / labels_expected", right_share, demands.min_right_share),
      at_most("label_errors", std::optional(s.label_errors), demands.max_label_errors),
      at_most("marker_rms_mm", s.marker_rms_mm, demands.max_marker_rms_mm),
      at_most("joint_rms_mm", s.joint_rms_mm, demands.max_joint_rms_mm),
  };
  return std::all_of(std::begin(met), std::end(met), [](bool m) { return m; });
}

int fail_stream(const Error& error) {
  fmt::print(stderr, "mocap-score: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitData : kExitNoInput;
}

int score_files(const StreamOptions& options) {
  Result<std::vector<scoring::EvalFrame>> known = scoring::read_frames(options.truth);
  if (!known) return fail_stream(known.error());
  const Result<scoring::Truth> truth = scoring::Truth::of(std::move(*known));
  if (!truth) return fail_stream({truth.error().code, options.truth + ": " + truth.error().message});
  const Result<std::vector<scoring::EvalFrame>> stream = scoring::read_frames(options.stream);
  if (!stream) return fail_stream(stream.error());

  const scoring::Score result = scoring::score(*truth, *stream, options.settings);

  fmt::print("{}{}", options.json ? to_json(result) : to_text(result), options.json ? "\n" : "");
  return meets(result, options.require_match ? filled_up(options.demands) : options.demands) ? 0 : kNotMet;
}

void add_options(cli::App& app, StreamOptions& options) {
  app.add_option("--truth", options.truth, "JSON lines of the truth")->required();
  app.add_option("--stream", options.stream, "JSON lines of the stream (mocap-watch --json); -: standard input")
      ->required();
  app.add_flag("--json", options.json, "print one JSON object");
  app.add_option("--after-s", options.settings.after_s, "start of scoring after the first label, s")
      ->check(cli::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_flag("--require-match", options.require_match,
               "exit 1 unless 60 frames were scored, 95 % of the labels are right, none is wrong, markers are within 2 "
               "mm rms and joints within 50 mm rms; the options below change single limits");
  Demands& demands = options.demands;
  app.add_option("--min-frames", demands.min_frames, "exit 1 if fewer frames were scored");
  app.add_option("--min-complete-share", demands.min_complete_share, "exit 1 if the share of complete sets is less");
  app.add_option("--min-right-share", demands.min_right_share, "exit 1 if the share of right labels is less");
  app.add_option("--max-label-errors", demands.max_label_errors, "exit 1 if more labels are wrong");
  app.add_option("--max-marker-rms-mm", demands.max_marker_rms_mm, "exit 1 if the marker error is larger");
  app.add_option("--max-joint-rms-mm", demands.max_joint_rms_mm, "exit 1 if the joint error is larger");
}

}  // namespace

int run_score(int argc, const char* const* argv) {
  StreamOptions options;
  cli::App app("Compares a stream of snapshots with the truth.", "mocap-score");
  add_options(app, options);
  app.examples(
      "  mocap-score --truth truth.jsonl --stream stream.jsonl\n"
      "  mocap-score score --truth truth.jsonl --stream stream.jsonl --require-match --min-complete-share 0.99");
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return score_files(options);
}

}  // namespace mocap::score
