#pragma once

#include <span>
#include <string>
#include <string_view>

#include "web/http_message.h"

namespace mocap::web {

/// A file of the page, which the build compressed and put into the program.
struct PageFile {
  std::string_view path;  ///< "/app.js"
  std::string_view gzip;
  std::string_view etag;  ///< with its quotation marks
};

/// All files of the page. Defined in page_data.cpp, which the build writes.
std::span<const PageFile> page_files();

/// The reply to GET for a file of the page; "/" is "/index.html". 404 if there is none, 304 if the browser has it.
HttpReply reply_with_file(std::span<const PageFile> files, const HttpRequest& request);

/// The media type by the end of the name.
std::string_view media_type_of(std::string_view path);

/// Decompresses a gzip stream; empty if it is damaged.
std::string gunzip(std::string_view gzip);

}  // namespace mocap::web
