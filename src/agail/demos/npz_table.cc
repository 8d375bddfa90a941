#include "agail/demos/npz_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <regex>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/zip.h"

namespace agail {
namespace {

static_assert(std::endian::native == std::endian::little);

struct Array {
  RowMatrix<double> values;  // a vector is one column
  bool integers = false;
  bool float32 = false;
};
using Arrays = std::map<std::string, Array>;

template <class T>
void widen(const std::uint8_t* bytes, RowMatrix<double>& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    T value;
    std::memcpy(&value, bytes + static_cast<std::size_t>(i) * sizeof(T), sizeof(T));
    values.data()[i] = static_cast<double>(value);
  }
}

bool widen(const std::string& type, const std::uint8_t* bytes, RowMatrix<double>& values) {
  if (type == "f4") return widen<float>(bytes, values), true;
  if (type == "f8") return widen<double>(bytes, values), true;
  if (type == "i1") return widen<std::int8_t>(bytes, values), true;
  if (type == "i2") return widen<std::int16_t>(bytes, values), true;
  if (type == "i4") return widen<std::int32_t>(bytes, values), true;
  if (type == "i8") return widen<std::int64_t>(bytes, values), true;
  if (type == "u1" || type == "b1") return widen<std::uint8_t>(bytes, values), true;
  if (type == "u2") return widen<std::uint16_t>(bytes, values), true;
  if (type == "u4") return widen<std::uint32_t>(bytes, values), true;
  if (type == "u8") return widen<std::uint64_t>(bytes, values), true;
  return false;
}

// numpy's format: magic, version, length of the header, the header (a Python dict), the numbers.
Array parse_npy(const std::vector<std::uint8_t>& bytes, const std::string& where) {
  const auto fail = [&](const std::string& what) -> void { throw InputError(where + " " + what); };
  if (bytes.size() < 12 || std::memcmp(bytes.data(), "\x93NUMPY", 6) != 0)
    fail("is not a numpy array");
  const std::size_t prefix = bytes[6] == 1 ? 10 : 12;
  std::size_t length = bytes[8] | static_cast<std::size_t>(bytes[9]) << 8;
  if (prefix == 12)
    length |= static_cast<std::size_t>(bytes[10]) << 16 | static_cast<std::size_t>(bytes[11]) << 24;
  // Plain numbers need some 100 bytes; std::regex takes stack for each.
  if (length > 4096 || bytes.size() < prefix + length)
    fail("has a damaged header, or does not hold plain numbers; use float32, float64 or int64");
  const std::string header(bytes.begin() + static_cast<std::ptrdiff_t>(prefix),
                           bytes.begin() + static_cast<std::ptrdiff_t>(prefix + length));
  std::smatch found;
  if (!std::regex_search(header, found, std::regex(R"('descr': *'([<>|=]?)([a-zA-Z]\d+)')")))
    fail("does not hold plain numbers; use float32, float64 or int64");
  const std::string order = found[1];
  const std::string type = found[2];
  if (order == ">") fail("is big-endian; convert it with .astype('<f8')");
  if (header.find("'fortran_order': True") != std::string::npos)
    fail("is in Fortran order; pass it through numpy.ascontiguousarray");
  if (!std::regex_search(header, found, std::regex(R"('shape': *\(([\d, ]*)\))")))
    fail("has a damaged header");
  std::vector<std::size_t> shape;
  const std::string sizes = found[1];
  const std::regex digits(R"(\d{1,12})");
  for (std::sregex_iterator it(sizes.begin(), sizes.end(), digits), end; it != end; ++it)
    shape.push_back(std::stoull(it->str()));
  if (shape.empty() || shape.size() > 2) fail("must be a vector or a matrix, one row a step");

  Array array;
  const std::size_t columns = shape.size() == 1 ? 1 : shape[1];
  const auto width = static_cast<std::size_t>(type[1] - '0');
  if (std::string("fiub").find(type[0]) == std::string::npos)
    fail("does not hold plain numbers; use float32, float64 or int64");
  const std::size_t data = bytes.size() - prefix - length;
  if (type.size() != 2 || width == 0)
    fail("does not hold plain numbers; use float32, float64 or int64");
  if (columns == 0) fail("has rows without entries; give one vector of numbers a step");
  const bool fits = shape[0] == 0 ? data == 0  // whatever the size of a row would be
                                  : shape[0] <= data && columns <= data / width &&
                                        shape[0] * columns * width == data;
  if (!fits) fail("has a size that does not fit its shape; save it again");
  array.values.resize(static_cast<Eigen::Index>(shape[0]), static_cast<Eigen::Index>(columns));
  if (!widen(type, bytes.data() + prefix + length, array.values))
    fail("does not hold plain numbers; use float32, float64 or int64");
  array.integers = type[0] != 'f';
  array.float32 = type == "f4";
  return array;
}

std::vector<double> flat(const RowMatrix<double>& values) {
  return {values.data(), values.data() + values.size()};
}

const Array* find(const Arrays& arrays, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const auto it = arrays.find(name); it != arrays.end()) return &it->second;
  return nullptr;
}

std::vector<std::size_t> starts_of(const Arrays& arrays, Eigen::Index rows,
                                   const std::string& path) {
  if (arrays.count("episodes") + arrays.count("episode_starts") + arrays.count("episode_ends") > 1)
    throw InputError(path +
                     " has more than one of episodes, episode_starts and episode_ends; keep one");
  if (const Array* ids = find(arrays, {"episodes"})) {
    if (ids->values.size() != rows)
      throw InputError(path + ": episodes must have one id for each observation");
    return split_at_changes(flat(ids->values), path);
  }
  const Array* starts = find(arrays, {"episode_starts"});
  const Array* ends = find(arrays, {"episode_ends"});
  if (starts == nullptr && ends == nullptr) return {};
  std::vector<std::size_t> result;
  const std::vector<double> given = flat(starts != nullptr ? starts->values : ends->values);
  if (starts == nullptr) result.push_back(0);
  for (const double row : given) {
    if (!(row >= 0 && row <= static_cast<double>(rows)) || std::floor(row) != row)
      throw InputError(path + ": episode_starts and episode_ends hold row numbers from 0 to " +
                       std::to_string(rows));
    result.push_back(static_cast<std::size_t>(row));
  }
  if (starts == nullptr) {
    if (result.back() != static_cast<std::size_t>(rows))
      throw InputError(path + ": the last of episode_ends must be the number of observations, " +
                       std::to_string(rows));
    result.pop_back();
  }
  if (result.empty()) throw InputError(path + ": there are no episodes in episode_starts");
  return result;
}

// N rows as they are; N - E rows with a row of NaN put in at the end of each episode.
RowMatrix<double> aligned(const RowMatrix<double>& values, const StepTable& table,
                          const std::string& name) {
  const Eigen::Index rows = table.observations.rows();
  if (values.rows() == rows) return values;
  const std::vector<std::size_t> starts =
      table.starts.empty() ? std::vector<std::size_t>{0} : table.starts;
  if (table.next_observations || values.rows() == 0 ||
      values.rows() + static_cast<Eigen::Index>(starts.size()) != rows)
    throw InputError(table.where + ": " + name + " has " + std::to_string(values.rows()) +
                     " rows, observations " + std::to_string(rows) +
                     "; give as many, or one fewer for each episode");
  RowMatrix<double> out =
      RowMatrix<double>::Constant(rows, values.cols(), std::numeric_limits<double>::quiet_NaN());
  Eigen::Index from = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const auto begin = static_cast<Eigen::Index>(starts[i]);
    const Eigen::Index end =
        i + 1 < starts.size() ? static_cast<Eigen::Index>(starts[i + 1]) : rows;
    if (end <= begin || end > rows)
      throw InputError(table.where + ": the beginnings of episodes must increase");
    out.middleRows(begin, end - begin - 1) = values.middleRows(from, end - begin - 1);
    from += end - begin - 1;
  }
  return out;
}

std::vector<double> column(const Arrays& arrays, std::initializer_list<const char*> names,
                           const StepTable& table) {
  const Array* array = find(arrays, names);
  if (array == nullptr) return {};
  if (array->values.cols() != 1)
    throw InputError(table.where + ": " + *names.begin() + " must have one value a row");
  return flat(aligned(array->values, table, *names.begin()));
}

void read_actions(const Arrays& arrays, StepTable& table) {
  table.actions.resize(table.observations.rows(), 0);
  const Array* actions = find(arrays, {"actions"});
  if (actions != nullptr) {
    table.actions = aligned(actions->values, table, "actions");
    table.discrete = actions->integers && actions->values.cols() == 1;
  }
  const Array* mask = find(arrays, {"action_available"});
  if (mask == nullptr) return;
  if (!((mask->values.array() == 0) || (mask->values.array() == 1)).all())
    throw InputError(table.where +
                     ": action_available has values other than 0 (missing) and 1 (known)");
  const RowMatrix<double> available = aligned(mask->values, table, "action_available");
  if (actions == nullptr) return;
  if (available.cols() != 1 && available.cols() != table.actions.cols())
    throw InputError(table.where +
                     ": action_available must have one column, or as many as actions");
  // NaN: the row of a final state.
  for (Eigen::Index t = 0; t < available.rows(); ++t)
    for (Eigen::Index k = 0; k < table.actions.cols(); ++k)
      if (available(t, available.cols() == 1 ? 0 : k) != 1)
        table.actions(t, k) = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

StepTable read_npz(const std::string& path, std::vector<std::string>& ignored) {
  Arrays arrays;
  for (const auto& [file, bytes] : unzip(read_file(path), path)) {
    const std::string name = file.ends_with(".npy") ? file.substr(0, file.size() - 4) : file;
    static const std::vector<std::string> known = {
        "observations", "actions",      "action_available", "next_observations",
        "rewards",      "terminations", "terminals",        "truncations",
        "timeouts",     "episodes",     "episode_starts",   "episode_ends"};
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      ignored.push_back(name);
      continue;
    }
    arrays[name] = parse_npy(bytes, path + ": " + name);
  }
  const Array* observations = find(arrays, {"observations"});
  if (observations == nullptr) throw InputError(path + " has no array observations");
  StepTable table;
  table.where = path;
  table.observations = observations->values;
  table.observations_are_float32 = observations->float32;
  if (const Array* next = find(arrays, {"next_observations"})) {
    table.next_observations = next->values;
    if (next->values.rows() != table.observations.rows() ||
        next->values.cols() != table.observations.cols())
      throw InputError(path + ": next_observations has not the shape of observations");
  }
  table.starts = starts_of(arrays, table.observations.rows(), path);
  read_actions(arrays, table);
  table.rewards = column(arrays, {"rewards"}, table);
  table.terminations = column(arrays, {"terminations", "terminals"}, table);
  table.truncations = column(arrays, {"truncations", "timeouts"}, table);
  return table;
}

}  // namespace agail
