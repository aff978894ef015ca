#pragma once

#include <string>

#include "take/mcap/records.h"

namespace mocap::take::mcap {

// Each function appends one whole record to `bytes`.

void encode(const Header& from, std::string& bytes);
void encode(const Footer& from, std::string& bytes);
void encode(const Schema& from, std::string& bytes);
void encode(const Channel& from, std::string& bytes);
void encode(const Message& from, std::string& bytes);
void encode(const Chunk& from, std::string& bytes);
void encode(const MessageIndex& from, std::string& bytes);
void encode(const ChunkIndex& from, std::string& bytes);
/// Computes the checksum; `from.crc` is ignored.
void encode(const Attachment& from, std::string& bytes);
void encode(const AttachmentIndex& from, std::string& bytes);
void encode(const Statistics& from, std::string& bytes);
void encode(const Metadata& from, std::string& bytes);
void encode(const MetadataIndex& from, std::string& bytes);
void encode(const SummaryOffset& from, std::string& bytes);
void encode(const DataEnd& from, std::string& bytes);

}  // namespace mocap::take::mcap
