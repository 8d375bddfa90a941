#include "agail/base/error.h"

#include <algorithm>
#include <stdexcept>

namespace agail {

std::string one_line(std::string message) {
  std::replace_if(
      message.begin(), message.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  return message;
}

void check_failed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string("internal error: ") + condition + " does not hold (" + file +
                         ":" + std::to_string(line) + "); please report it");
}

}  // namespace agail
