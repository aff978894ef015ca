#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "base/result.h"
#include "corpus/figures.h"

namespace mocap::corpus {

/// The frozen figures of all recordings, by name.
struct Table {
  std::string reason;  ///< why it was last written
  std::map<std::string, Figures> figures;
};

/// Reads a table: lines of columns separated by tabs, after lines of '#'. Fails with NotFound, and with InvalidArgument
/// and the line.
Result<Table> read_table(const std::filesystem::path& path);

Status write_table(const std::filesystem::path& path, const Table& table);

/// The figures of `now` that differ from the frozen ones by more than other processors and compilers explain; empty: as
/// frozen. The hash is not compared. Begins with
/// `now.fault` if there is one.
std::string difference(const Figures& frozen, const Figures& now);

}  // namespace mocap::corpus
