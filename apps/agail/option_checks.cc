#include "option_checks.h"

#include <charconv>

namespace agail {

CLI::Validator whole_number(std::uint64_t low, std::uint64_t high) {
  const std::string range = std::to_string(low) + " to " + std::to_string(high);
  const auto check = [low, high, range](std::string& text) -> std::string {
    std::uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [read, error] = std::from_chars(text.data(), end, value);
    const bool plain = error == std::errc() && read == end && (text[0] != '0' || text.size() == 1);
    if (plain && value >= low && value <= high) return "";
    return "'" + text + "' is not a whole number from " + range + ", written like 10";
  };
  return {check, high == std::numeric_limits<std::uint64_t>::max() ||
                         high == std::numeric_limits<std::int64_t>::max()
                     ? "from " + std::to_string(low)
                     : range};
}

CLI::Validator not_empty() {
  return {[](std::string& text) -> std::string {
            return text.empty() ? "it is empty; give a value" : "";
          },
          ""};
}

}  // namespace agail
