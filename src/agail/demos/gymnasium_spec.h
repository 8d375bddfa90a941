// What Gymnasium's registry says of the built-in environments, so that Minari can recover them from
// a file of ours.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace agail {

// Gymnasium's EnvSpec as its to_json() writes it. For an id that is not built in: only the id,
// which loads but does not name a class to build.
nlohmann::ordered_json gymnasium_spec(const std::string& id);

// Whether Gymnasium accepts `id`: [namespace/]name[-v1].
bool is_gymnasium_id(const std::string& id);

}  // namespace agail
