#pragma once

#include <optional>
#include <string>
#include <vector>

namespace mocap::preflight {

enum class Verdict { Good, Warning, Bad };

/// The result of one check.
struct Finding {
  std::string check;  ///< "net.core.rmem_max"
  Verdict verdict = Verdict::Good;
  std::string what;                              ///< the state that was found
  std::string cure;                              ///< a command that repairs the state; empty: none
  std::optional<double> minutes = std::nullopt;  ///< of `what`, for a display; empty: it has none
};

Finding good(std::string check, std::string what);
Finding warning(std::string check, std::string what, std::string cure);
Finding bad(std::string check, std::string what, std::string cure);

bool is_bad(const std::vector<Finding>& findings);

/// A JSON array of the findings: check, verdict ("good", "warning" or "bad"), what, cure, and minutes if it has any.
std::string json_of(const std::vector<Finding>& findings);
/// Prints the findings for people, or as a JSON array.
void print(const std::vector<Finding>& findings, bool json);

}  // namespace mocap::preflight
