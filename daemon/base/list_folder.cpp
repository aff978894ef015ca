#include "base/list_folder.h"

#include <algorithm>

namespace mocap {

FolderContents list_folder(const std::filesystem::path& folder) {
  using std::filesystem::directory_iterator;
  FolderContents contents;
  for (directory_iterator at(folder, contents.error); !contents.error && at != directory_iterator();
       at.increment(contents.error)) {
    contents.paths.push_back(at->path());
  }
  std::ranges::sort(contents.paths);
  return contents;
}

}  // namespace mocap
