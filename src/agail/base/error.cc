#include "agail/base/error.h"

#include <stdexcept>

namespace agail {

void check_failed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string("internal error: ") + condition + " does not hold (" + file +
                         ":" + std::to_string(line) + "); please report it");
}

}  // namespace agail
