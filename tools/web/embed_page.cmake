# Writes a C++ file with all files of a folder, compressed: page_files() of tools/web/page_files.h.
# usage: cmake -DFOLDER=DIR -DOUT=FILE.cpp -P embed_page.cmake
file(GLOB_RECURSE files RELATIVE "${FOLDER}" "${FOLDER}/*")
list(SORT files)
set(data "")
set(table "")
set(number 0)
foreach(file IN LISTS files)
  set(packed "${OUT}.gz")
  execute_process(COMMAND gzip -9 --no-name --stdout "${FOLDER}/${file}" OUTPUT_FILE "${packed}" COMMAND_ERROR_IS_FATAL ANY)
  file(READ "${packed}" hex HEX)
  file(REMOVE "${packed}")
  file(SHA256 "${FOLDER}/${file}" hash)
  string(SUBSTRING "${hash}" 0 16 hash)
  string(REGEX REPLACE "(................................................................)" "\\1\n" hex "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND data "constexpr unsigned char kFile${number}[] = {\n${bytes}};\n")
  string(APPEND table "    {\"/${file}\", text(kFile${number}), \"\\\"${hash}\\\"\"},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE "${OUT}" "// Written by embed_page.cmake.
#include \"web/page_files.h\"

namespace mocap::web {
namespace {

${data}
template <std::size_t N>
std::string_view text(const unsigned char (&bytes)[N]) {
  return {reinterpret_cast<const char*>(bytes), N};
}

}  // namespace

std::span<const PageFile> page_files() {
  static const PageFile kFiles[] = {
${table}  };
  return kFiles;
}

}  // namespace mocap::web
")
