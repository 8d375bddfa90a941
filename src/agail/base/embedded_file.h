// A text file that was compiled into the binary (cmake/EmbedFiles.cmake).
#pragma once

#include <string_view>

namespace agail {

struct EmbeddedFile {
  std::string_view name;  // file name with its extension
  std::string_view text;
};

}  // namespace agail
