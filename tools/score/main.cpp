// mocap-score: compares a recorded stream of snapshots with the truth. See --help.
#include "lib/cli/commands.h"
#include "score/command.h"

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  static constexpr cli::Command kCommands[] = {
      {"score", "the quick check of a stream (the default)", score::run_score},
      {"labels", "precision, recall and label errors of a stream", score::run_labels},
      {"skeleton", "joint and rotation errors of a stream", score::run_skeleton},
  };
  static constexpr const char* kExamples = R"(examples:
  mocap-score --truth truth.jsonl --stream stream.jsonl
      frames, labels, marker and joint errors
  mocap-score labels --truth truth.jsonl --stream stream.jsonl
      labels, one line for each subject
  mocap-score skeleton --truth truth.jsonl --stream stream.jsonl --json)";
  static constexpr cli::Program kProgram{"mocap-score", "compares a recorded feed with the truth of mocap-sim",
                                         kCommands, kExamples};
  return cli::run_command(kProgram, argc, argv);
}
