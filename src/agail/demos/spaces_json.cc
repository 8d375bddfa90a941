#include "agail/demos/spaces_json.h"

#include <cmath>
#include <limits>

#include "agail/base/error.h"

namespace agail {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kMostNumbers = 1 << 16;
constexpr int kDeepest = 100;

int nesting(char c) { return c == '{' || c == '[' ? 1 : c == '}' || c == ']' ? -1 : 0; }

// Bare Infinity, -Infinity and NaN as strings; what stands inside of strings is left alone. Empty,
// which is no JSON, if it is nested so deep that handling it could exhaust the stack: no metadata
// are.
std::string quote_constants(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  bool inside = false;
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (inside && text[i] == '\\' && i + 1 < text.size()) {
      out += text[i++];
      out += text[i];
      continue;
    }
    if (text[i] == '"') inside = !inside;
    if (!inside) depth += nesting(text[i]);
    if (depth > kDeepest) return {};
    bool replaced = false;
    for (const char* constant : {"-Infinity", "Infinity", "NaN"}) {
      if (inside || text.compare(i, std::char_traits<char>::length(constant), constant) != 0)
        continue;
      out += '"' + std::string(constant) + '"';
      i += std::char_traits<char>::length(constant) - 1;
      replaced = true;
      break;
    }
    if (!replaced) out += text[i];
  }
  return out;
}

// As Python's json writes it.
std::string number(double value) {
  if (std::isinf(value)) return value < 0 ? "-Infinity" : "Infinity";
  return json(value).dump();
}

std::string box(const std::vector<float>& low, const std::vector<float>& high, bool is_float32) {
  std::string text = R"({"type": "Box", "dtype": ")" +
                     std::string(is_float32 ? "float32" : "float64") + R"(", "shape": [)" +
                     std::to_string(low.size()) + "]";
  for (const auto& [name, bounds] : {std::pair{"low", &low}, std::pair{"high", &high}}) {
    text += std::string(", \"") + name + "\": [";
    for (std::size_t i = 0; i < bounds->size(); ++i)
      text += (i == 0 ? "" : ", ") + number(static_cast<double>((*bounds)[i]));
    text += "]";
  }
  return text + "}";
}

std::vector<float> bounds(const json& values, std::size_t dim, const std::string& where) {
  std::vector<float> result;
  const auto add = [&](const json& value) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (value.is_number()) {
      result.push_back(static_cast<float>(value.get<double>()));
    } else if (value == "Infinity" || value == "-Infinity") {
      result.push_back(value == "Infinity" ? kInfinity : -kInfinity);
    } else {
      throw InputError(where + ": the bounds of the action space are not numbers");
    }
  };
  if (values.is_array()) {
    if (values.size() != dim)
      throw InputError(where + ": the bounds of the action space do not fit its shape");
    for (const json& value : values) add(value);
  } else {
    add(values);
    result.resize(dim, result.front());
  }
  return result;
}

}  // namespace

template <class Json>
Json parse_python_json(const std::string& text, const std::string& where) {
  Json parsed = Json::parse(quote_constants(text), nullptr, /*allow_exceptions=*/false);
  if (parsed.is_discarded()) throw InputError(where + " is not valid JSON");
  return parsed;
}

template json parse_python_json<json>(const std::string&, const std::string&);
template ordered_json parse_python_json<ordered_json>(const std::string&, const std::string&);

json space_from_json(const std::string& text) {
  try {
    return parse_python_json(text, "");
  } catch (const InputError&) {
    return json();
  }
}

std::optional<DiscreteSpace> discrete_space_from_json(const std::string& text,
                                                      const std::string& where) {
  const json space = space_from_json(text);
  if (!space.is_object() || space.value("type", json()) != "Discrete") return std::nullopt;
  constexpr std::int64_t kFurthest = std::int64_t{1}
                                     << 53;  // to there doubles tell whole numbers apart
  const json n = space.value("n", json());
  const json start = space.value("start", json(0));
  if (!n.is_number_integer() || n < 1 || n > kMostNumbers || !start.is_number_integer() ||
      start < -kFurthest || start > kFurthest)
    throw InputError(where + ": a Discrete space needs n from 1 to " +
                     std::to_string(kMostNumbers) + ", and a start within 2^53");
  return DiscreteSpace{.start = start.get<std::int64_t>(), .n = n.get<int>()};
}

std::string action_space_to_json(const ActionSpace& space, bool is_float32) {
  if (space.discrete)
    return R"({"type": "Discrete", "dtype": "int64", "start": 0, "n": )" + std::to_string(space.n) +
           "}";
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto dim = static_cast<std::size_t>(space.dim);
  const bool bounded = space.low.size() == dim && space.high.size() == dim;
  return box(bounded ? space.low : std::vector<float>(dim, -kInfinity),
             bounded ? space.high : std::vector<float>(dim, kInfinity), is_float32);
}

std::string observation_space_to_json(int dim, bool is_float32) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto size = static_cast<std::size_t>(dim);
  return box(std::vector<float>(size, -kInfinity), std::vector<float>(size, kInfinity), is_float32);
}

ActionSpace action_space_from_json(const std::string& text, const std::string& where) {
  const json parsed = parse_python_json(text, where);
  const auto field = [&](const char* name) -> json {
    return parsed.is_object() && parsed.contains(name) ? parsed[name] : json();
  };
  ActionSpace space;
  if (field("type") == "Discrete") {
    const json n = field("n");
    if (!n.is_number_integer() || n < 1 || n > kMostNumbers)
      throw InputError(where + ": a Discrete action space needs n from 1 to " +
                       std::to_string(kMostNumbers));
    if (!field("start").is_null() && field("start") != 0)
      throw InputError(
          where + ": a Discrete action space must start at 0; subtract the start from the actions");
    space.discrete = true;
    space.dim = 1;
    space.n = n.get<int>();
    return space;
  }
  if (field("type") != "Box")
    throw InputError(
        where +
        ": only Box and Discrete action spaces are supported; flatten the actions into one Box");
  const json shape = field("shape");
  if (!shape.is_array() || shape.size() != 1 || !shape[0].is_number_integer() || shape[0] < 1 ||
      shape[0] > kMostNumbers)
    throw InputError(where + ": the action space must be a vector; flatten the actions");
  space.dim = shape[0].get<int>();
  space.low = bounds(field("low"), static_cast<std::size_t>(space.dim), where);
  space.high = bounds(field("high"), static_cast<std::size_t>(space.dim), where);
  return space;
}

}  // namespace agail
