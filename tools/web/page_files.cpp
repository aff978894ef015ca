#include "web/page_files.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace mocap::web {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
    {".webmanifest", "application/manifest+json"},
}};

}  // namespace

std::string_view media_type_of(std::string_view path) {
  const auto found = std::ranges::find_if(kTypes, [&](const auto& type) { return path.ends_with(type.first); });
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

std::string gunzip(std::string_view gzip) {
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzip) != Z_OK) return {};
  std::string input(gzip);
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  std::string all;
  std::array<char, 16384> block;
  int result = Z_OK;
  while (result == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    result = inflate(&stream, Z_NO_FLUSH);
    all.append(block.data(), block.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return result == Z_STREAM_END ? all : std::string();
}

HttpReply reply_with_file(std::span<const PageFile> files, const HttpRequest& request) {
  const std::string_view path = request.path == "/" ? "/index.html" : std::string_view(request.path);
  const auto file = std::ranges::find(files, path, &PageFile::path);
  if (file == files.end()) return refusal(404, "there is no such file; the page is at /");
  HttpReply reply{200, std::string(media_type_of(path)), {}};
  reply.headers = {{"ETag", std::string(file->etag)}, {"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding"}};
  if (request.if_none_match.find(file->etag) != std::string::npos) {
    reply.status = 304;
    return reply;
  }
  if (request.accept_encoding.find("gzip") == std::string::npos) {
    reply.body = gunzip(file->gzip);
    return reply;
  }
  reply.headers.emplace_back("Content-Encoding", "gzip");
  reply.body = file->gzip;
  return reply;
}

}  // namespace mocap::web
