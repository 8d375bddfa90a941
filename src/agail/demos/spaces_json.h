// Spaces as Minari writes them into its metadata.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "agail/base/spaces.h"

namespace agail {

// Python's json writes and reads Infinity, -Infinity and NaN, which JSON does not have. Here they
// become the strings of that name. Throws InputError, starting with `where`, if it is not JSON
// either way, or nested more than 100 deep. Json: nlohmann::json or nlohmann::ordered_json.
template <class Json = nlohmann::json>
Json parse_python_json(const std::string& text, const std::string& where);

// In one line; what is no UTF-8 is replaced.
template <class Json>
std::string json_text(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// {"type": "Box", ...} or {"type": "Discrete", ...}.
std::string action_space_to_json(const ActionSpace& space, bool is_float32);
std::string observation_space_to_json(int dim, bool is_float32);

// Throws InputError, starting with `where`, for any other kind of space, and for bounds that do not
// fit the shape.
ActionSpace action_space_from_json(const std::string& text, const std::string& where);

// The whole numbers from `start` to `start` + `n` - 1.
struct DiscreteSpace {
  std::int64_t start = 0;
  int n = 0;
};

// None for any other kind of space. Throws InputError, starting with `where`, for one that is too
// large.
std::optional<DiscreteSpace> discrete_space_from_json(const std::string& text,
                                                      const std::string& where);

// Any space; null for what is no JSON, such as Python's str(space).
nlohmann::json space_from_json(const std::string& text);

}  // namespace agail
