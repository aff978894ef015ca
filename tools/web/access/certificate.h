#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace mocap::web {

struct NewCertificate {
  std::filesystem::path certificate;  ///< PEM file
  std::filesystem::path private_key;  ///< PEM file, mode 600
  std::string sha256;                 ///< fingerprint, "AB:CD:..."
};

/// Makes a key (P-256) and a certificate signed by itself, valid for `days`, for localhost, the loopback addresses and
/// `names` (host names and addresses): PREFIX.crt and PREFIX.key. Fails with Busy if one of the files exists, and with
/// Io.
Result<NewCertificate> make_certificate(const std::string& prefix, const std::vector<std::string>& names, int days);

/// The names of this machine by which others reach it: its host name, with and without ".local".
std::vector<std::string> names_of_this_machine();

}  // namespace mocap::web
