#include "agail/demos/hdf5.h"

#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"

namespace agail::hdf5 {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

// Deflate cannot shrink anything further than 1032 : 1, so a file that claims more is lying.
constexpr std::size_t kBestCompression = 1032;
constexpr std::size_t kLongestText = std::size_t{16} << 20;

// Before the first use of HDF5. It prints its error stack to stderr unless told otherwise; our
// messages say what the user can do. And it closes at exit what is still open, which is only what
// could not be written: it would crash.
void prepare() {
  static const herr_t once = H5dont_atexit();
  static_cast<void>(once);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

herr_t find_version(unsigned, const H5E_error2_t* error, void* found) noexcept {
  if (error->desc != nullptr && std::strstr(error->desc, "version number") != nullptr)
    *static_cast<bool*>(found) = true;
  return 0;
}

// Of what just failed in HDF5: a sound file may be newer than our library.
std::string reason() {
  bool newer = false;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find_version, &newer);
  return newer ? " is damaged, or in a newer format than HDF5 1.10's; write it again (h5py: "
                 "libver=(\"earliest\", \"v110\"))"
               : " cannot be read; the file is damaged, copy or record it again";
}

Handle own(hid_t id, Handle::Close close, const std::string& where) {
  if (id < 0) throw InputError(where + reason());
  return Handle(id, close);
}

// For what fails only if the machine does.
[[noreturn]] void unwritten(const std::string& file) {
  throw SystemError("cannot write " + file + "; is the disk full?");
}
hid_t made(hid_t id, const std::string& file = "a file") {
  if (id < 0) unwritten(file);
  return id;
}
void done(herr_t status, const std::string& file = "a file") { made(status, file); }

int close_type(std::int64_t id) { return H5Tclose(id); }
int close_space(std::int64_t id) { return H5Sclose(id); }
int close_dataset(std::int64_t id) { return H5Dclose(id); }
int close_attribute(std::int64_t id) { return H5Aclose(id); }
int close_group(std::int64_t id) { return H5Gclose(id); }
int close_file(std::int64_t id) { return H5Fclose(id); }
int close_properties(std::int64_t id) { return H5Pclose(id); }

Handle properties(hid_t kind) { return Handle(made(H5Pcreate(kind)), close_properties); }

Handle untimed(hid_t kind) {
  Handle list = properties(kind);
  done(H5Pset_obj_track_times(list.id(), false));  // equal contents, equal bytes
  return list;
}

Handle access_properties() {
  Handle list = properties(H5P_FILE_ACCESS);
  done(H5Pset_fclose_degree(list.id(), H5F_CLOSE_STRONG));
  return list;
}

template <class Info>
herr_t collect_name(hid_t, const char* name, const Info*, void* names) noexcept {
  try {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return 0;
  } catch (const std::bad_alloc&) {
    return -1;
  }
}

std::optional<Number> number_of(hid_t type) {
  const std::size_t bytes = H5Tget_size(type);
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      if (bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8) return Number::kInteger;
      return std::nullopt;
    case H5T_FLOAT:
      if (bytes == 2 || bytes == 4 || bytes == 8) return Number::kReal;
      return std::nullopt;
    case H5T_ENUM:  // h5py's booleans
      if (bytes == 1) return Number::kBoolean;
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

// Nothing outside of this file is opened on its behalf, and no chunk is larger than the file could
// fill.
void check_storage(hid_t dataset, std::size_t claimed_bytes, std::size_t file_bytes,
                   const std::string& where) {
  const Handle creation = own(H5Dget_create_plist(dataset), close_properties, where);
  const H5D_layout_t layout = H5Pget_layout(creation.id());
  if (layout < 0 || layout == H5D_VIRTUAL || H5Pget_external_count(creation.id()) != 0)
    throw InputError(where +
                     " keeps its values in other files; store them in this one (h5repack does)");
  const std::size_t stored = std::min<std::size_t>(H5Dget_storage_size(dataset), file_bytes);
  if (claimed_bytes / kBestCompression > stored || (claimed_bytes > 0 && stored == 0))
    throw InputError(
        where + " claims more values than the file can hold; it is damaged or was never filled");
  if (layout != H5D_CHUNKED) return;
  hsize_t chunk[H5S_MAX_RANK];
  const int rank = H5Pget_chunk(creation.id(), H5S_MAX_RANK, chunk);
  const Handle type = own(H5Dget_type(dataset), close_type, where);
  std::size_t chunk_bytes = std::max<std::size_t>(1, H5Tget_size(type.id()));
  const std::size_t most = std::max(claimed_bytes, file_bytes) + (std::size_t{64} << 20);
  for (int i = 0; i < rank; ++i) {
    if (chunk[i] == 0 || chunk_bytes > most / chunk[i])
      throw InputError(where + " has chunks larger than the file; it is damaged");
    chunk_bytes *= chunk[i];
  }
}

hid_t memory_type(Type type) {
  switch (type) {
    case Type::kFloat32:
      return H5T_NATIVE_FLOAT;
    case Type::kFloat64:
      return H5T_NATIVE_DOUBLE;
    case Type::kInt64:
      return H5T_NATIVE_INT64;
    case Type::kUint8:
      return H5T_NATIVE_UINT8;
    case Type::kBoolean:
      break;
  }
  AGAIL_CHECK(false);
}

// As h5py stores numpy's bool.
Handle boolean_type() {
  Handle type(made(H5Tenum_create(H5T_NATIVE_INT8)), close_type);
  const std::int8_t no = 0;
  const std::int8_t yes = 1;
  done(H5Tenum_insert(type.id(), "FALSE", &no));
  done(H5Tenum_insert(type.id(), "TRUE", &yes));
  return type;
}

}  // namespace

TemporaryPath::~TemporaryPath() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

std::string Group::where(const std::string& name) const {
  std::string text = path_;
  if (!name.empty()) text += (text.empty() ? "" : "/") + name;
  return text.empty() ? file_ : file_ + ": " + text;
}

std::vector<std::string> Group::names() const {
  std::vector<std::string> names;
  if (H5Literate(handle_.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name<H5L_info_t>,
                 &names) < 0)
    throw InputError(where() + reason());
  return names;
}

std::vector<std::string> Group::attribute_names() const {
  std::vector<std::string> names;
  if (H5Aiterate2(handle_.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name<H5A_info_t>,
                  &names) < 0)
    throw InputError(where() + reason());
  return names;
}

Kind Group::kind(const std::string& name) const {
  H5L_info_t link;
  if (H5Lexists(handle_.id(), name.c_str(), H5P_DEFAULT) <= 0) return Kind::kNothing;
  if (H5Lget_info(handle_.id(), name.c_str(), &link, H5P_DEFAULT) < 0) return Kind::kOther;
  if (link.type != H5L_TYPE_HARD)
    return Kind::kOther;  // soft and external links lead who knows where
  H5O_info_t object;
  if (H5Oget_info_by_name2(handle_.id(), name.c_str(), &object, H5O_INFO_BASIC, H5P_DEFAULT) < 0)
    return Kind::kOther;
  if (object.type == H5O_TYPE_GROUP) return Kind::kGroup;
  return object.type == H5O_TYPE_DATASET ? Kind::kDataset : Kind::kOther;
}

Group Group::group(const std::string& name) const {
  Group child;
  child.handle_ = own(H5Gopen2(handle_.id(), name.c_str(), H5P_DEFAULT), close_group, where(name));
  child.file_ = file_;
  child.path_ = path_.empty() ? name : path_ + "/" + name;
  child.file_bytes_ = file_bytes_;
  return child;
}

DatasetInfo Group::describe(const std::string& name) const {
  const std::string place = where(name);
  const Handle dataset =
      own(H5Dopen2(handle_.id(), name.c_str(), H5P_DEFAULT), close_dataset, place);
  const Handle type = own(H5Dget_type(dataset.id()), close_type, place);
  const Handle space = own(H5Dget_space(dataset.id()), close_space, place);

  DatasetInfo info;
  if (H5Tget_class(type.id()) == H5T_VLEN)  // Minari's JPEGs
    throw InputError(
        place +
        " has entries of varying length, as stored images do; give one vector of numbers a step");
  const std::optional<Number> number = number_of(type.id());
  if (!number)
    throw InputError(place +
                     " does not hold plain numbers; convert it to float64, float32 or int64");
  info.number = *number;
  info.bytes = H5Tget_size(type.id());

  const int rank = H5Sget_simple_extent_type(space.id()) == H5S_NULL
                       ? -1
                       : H5Sget_simple_extent_ndims(space.id());
  if (rank < 0)
    throw InputError(place + " is empty; every dataset of an episode has one row a step");
  hsize_t sizes[H5S_MAX_RANK];
  if (rank > 0 && H5Sget_simple_extent_dims(space.id(), sizes, nullptr) < 0)
    throw InputError(place + " has no readable shape; the file is damaged");
  std::size_t bytes = info.bytes;
  for (int i = 0; i < rank; ++i) {
    if (sizes[i] > 0 && bytes > (std::numeric_limits<std::size_t>::max() >> 4) / sizes[i])
      throw InputError(place + " claims more values than the file can hold; it is damaged");
    bytes *= sizes[i];
    info.shape.push_back(sizes[i]);
  }
  check_storage(dataset.id(), bytes, file_bytes_, place);
  return info;
}

void Group::read(const std::string& name, std::span<double> values) const {
  const std::string place = where(name);
  const Handle dataset =
      own(H5Dopen2(handle_.id(), name.c_str(), H5P_DEFAULT), close_dataset, place);
  const Handle space = own(H5Dget_space(dataset.id()), close_space, place);
  if (H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(values.size()))
    throw InputError(place + " changed its size while it was read");
  if (values.empty()) return;
  if (H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw InputError(
        place +
        " cannot be read: damaged, cut short, or compressed with a filter that is not installed" +
        " (rewrite it with gzip or none)");
}

std::optional<std::string> Group::text_attribute(const std::string& name) const {
  if (H5Aexists(handle_.id(), name.c_str()) <= 0) return std::nullopt;
  const std::string place = where() + ", attribute " + name;
  const Handle attribute =
      own(H5Aopen(handle_.id(), name.c_str(), H5P_DEFAULT), close_attribute, place);
  const Handle type = own(H5Aget_type(attribute.id()), close_type, place);
  const Handle space = own(H5Aget_space(attribute.id()), close_space, place);
  if (H5Tget_class(type.id()) != H5T_STRING || H5Sget_simple_extent_npoints(space.id()) != 1)
    return std::nullopt;

  if (H5Tis_variable_str(type.id()) > 0) {
    char* text = nullptr;
    if (H5Aread(attribute.id(), type.id(), &text) < 0 || text == nullptr) return std::nullopt;
    std::string copy(text);
    H5free_memory(text);
    return copy;
  }
  const std::size_t bytes = H5Tget_size(type.id());
  if (bytes > std::min(kLongestText, file_bytes_)) return std::nullopt;
  std::string text(bytes, '\0');
  if (H5Aread(attribute.id(), type.id(), text.data()) < 0) return std::nullopt;
  text.resize(std::min(text.find('\0'), text.size()));
  return text;
}

bool Group::read_number(const std::string& name, Number number, std::int64_t type,
                        void* value) const {
  if (H5Aexists(handle_.id(), name.c_str()) <= 0) return false;
  const std::string place = where() + ", attribute " + name;
  const Handle attribute =
      own(H5Aopen(handle_.id(), name.c_str(), H5P_DEFAULT), close_attribute, place);
  const Handle stored = own(H5Aget_type(attribute.id()), close_type, place);
  const Handle space = own(H5Aget_space(attribute.id()), close_space, place);
  return number_of(stored.id()) == number && H5Sget_simple_extent_npoints(space.id()) == 1 &&
         H5Aread(attribute.id(), type, value) >= 0;
}

std::optional<std::int64_t> Group::integer_attribute(const std::string& name) const {
  std::int64_t value = 0;
  if (!read_number(name, Number::kInteger, H5T_NATIVE_INT64, &value) || unsigned_attribute(name))
    return std::nullopt;
  return value;
}

// Of what does not fit into the type that is read HDF5 makes the nearest number that does.
std::optional<std::uint64_t> Group::unsigned_attribute(const std::string& name) const {
  constexpr std::uint64_t kMostSigned = std::numeric_limits<std::int64_t>::max();
  std::uint64_t value = 0;
  if (!read_number(name, Number::kInteger, H5T_NATIVE_UINT64, &value) || value <= kMostSigned)
    return std::nullopt;
  return value;
}

std::optional<double> Group::real_attribute(const std::string& name) const {
  double value = 0;
  if (!read_number(name, Number::kReal, H5T_NATIVE_DOUBLE, &value) || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<bool> Group::boolean_attribute(const std::string& name) const {
  std::int8_t value = 0;
  if (!read_number(name, Number::kBoolean, H5T_NATIVE_INT8, &value)) return std::nullopt;
  return value != 0;
}

Group Group::create_group(const std::string& name) {
  const Handle creation = untimed(H5P_GROUP_CREATE);
  Group child;
  child.handle_ = Handle(
      made(H5Gcreate2(handle_.id(), name.c_str(), H5P_DEFAULT, creation.id(), H5P_DEFAULT), file_),
      close_group);
  child.file_ = file_;
  child.path_ = path_.empty() ? name : path_ + "/" + name;
  return child;
}

void Group::write(const std::string& name, const std::vector<std::size_t>& shape, Type type,
                  const void* values) {
  const std::vector<hsize_t> sizes(shape.begin(), shape.end());
  const auto rank = static_cast<int>(sizes.size());
  const Handle space(made(H5Screate_simple(rank, sizes.data(), nullptr)), close_space);
  const Handle creation = untimed(H5P_DATASET_CREATE);
  // One chunk, unless it is so large that reading a part of it should not mean inflating all.
  std::vector<hsize_t> chunk = sizes;
  hsize_t row = 8;
  for (std::size_t i = 1; i < sizes.size(); ++i) row *= sizes[i];
  chunk[0] = std::min<hsize_t>(chunk[0], std::max<hsize_t>(1, (hsize_t{4} << 20) / row));
  done(H5Pset_chunk(creation.id(), rank, chunk.data()));
  done(H5Pset_shuffle(creation.id()));
  done(H5Pset_deflate(creation.id(), 4));
  done(H5Pset_fletcher32(creation.id()));  // so that damage is noticed
  const Handle boolean = boolean_type();
  const hid_t stored = type == Type::kBoolean ? boolean.id() : memory_type(type);
  Handle dataset(made(H5Dcreate2(handle_.id(), name.c_str(), stored, space.id(), H5P_DEFAULT,
                                 creation.id(), H5P_DEFAULT),
                      file_),
                 close_dataset);
  done(H5Dwrite(dataset.id(), stored, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), file_);
  if (!dataset.release()) unwritten(file_);  // only now are chunks written
}

void Group::write_scalar(const std::string& name, std::int64_t type, const void* value) {
  const Handle space(made(H5Screate(H5S_SCALAR)), close_space);
  const Handle attribute(
      made(H5Acreate2(handle_.id(), name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
           file_),
      close_attribute);
  done(H5Awrite(attribute.id(), type, value), file_);
}

void Group::write_attribute(const std::string& name, const std::string& text) {
  const Handle type(made(H5Tcopy(H5T_C_S1)), close_type);
  done(H5Tset_size(type.id(), H5T_VARIABLE));
  done(H5Tset_cset(type.id(), H5T_CSET_UTF8));
  const char* value = text.c_str();
  write_scalar(name, type.id(), &value);
}
void Group::write_attribute(const std::string& name, std::int64_t number) {
  write_scalar(name, H5T_NATIVE_INT64, &number);
}
void Group::write_attribute(const std::string& name, std::uint64_t number) {
  write_scalar(name, H5T_NATIVE_UINT64, &number);
}
void Group::write_attribute(const std::string& name, double number) {
  write_scalar(name, H5T_NATIVE_DOUBLE, &number);
}
void Group::write_boolean_attribute(const std::string& name, bool value) {
  const std::int8_t number = value ? 1 : 0;
  write_scalar(name, boolean_type().id(), &number);
}

File File::wrap(Handle handle, const std::string& name) {
  File file;
  file.handle_ = std::move(handle);
  file.root_.file_ = name;
  file.root_.handle_ = own(H5Gopen2(file.handle_.id(), "/", H5P_DEFAULT), close_group, name);
  return file;
}

File File::open(const std::string& path) {
  prepare();
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw InputError(path + " cannot be read: " + error.message());
  if (!std::ifstream(path))
    throw InputError(path + " cannot be opened; check that you may read it");
  const Handle access = access_properties();
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id());
  if (id < 0) {
    if (H5Fis_hdf5(path.c_str()) > 0)
      throw InputError(
          path +
          " is open for writing elsewhere, was not closed, or is cut short; close it (or run "
          "h5clear -s on it), or copy it again");
    throw InputError(
        path +
        " is not a complete HDF5 file; give a Minari file (.hdf5), a Minari dataset folder or id");
  }
  File file = wrap(Handle(id, close_file), path);
  file.root_.file_bytes_ = bytes;
  return file;
}

File File::from_image(std::span<const std::uint8_t> bytes, const std::string& name) {
  prepare();
  const Handle access = access_properties();
  done(H5Pset_fapl_core(access.id(), std::size_t{1} << 20, false));
  std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
  if (copy.empty()) throw InputError(name + " is empty");
  done(H5Pset_file_image(access.id(), copy.data(), copy.size()));
  const hid_t id = H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.id());
  if (id < 0) throw InputError(name + " is not a complete HDF5 file");
  File file = wrap(Handle(id, close_file), name);
  file.root_.file_bytes_ = bytes.size();
  return file;
}

File File::create(const std::string& path) {
  prepare();
  const Handle access = access_properties();
  // The 1.10 format is the first that checksums its own structure and has no overhead for a dataset
  // of one chunk.
  done(H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110));
  const Handle creation = untimed(H5P_FILE_CREATE);
  // Nobody else knows the file, and some network file systems have no locks.
  done(H5Pset_file_locking(access.id(), false, true));
  Handle handle(made(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.id(), access.id()), path),
                close_file);
  return wrap(std::move(handle), path);
}

File File::create_temporary() {
  std::string path = (std::filesystem::temp_directory_path() / "agail-XXXXXX").string();
  const int descriptor = ::mkstemp(path.data());
  if (descriptor < 0) throw SystemError("cannot create " + path + ": " + std::strerror(errno));
  ::close(descriptor);
  TemporaryPath temporary(path);
  File file = create(path);
  file.temporary_ = std::move(temporary);
  return file;
}

void File::close() {
  const std::string path = root_.file_;
  root_ = Group();
  if (!handle_.release()) unwritten(path);
}

std::vector<std::uint8_t> File::close_and_take() {
  close();
  return read_file(temporary_.get(), std::numeric_limits<std::size_t>::max());
}

}  // namespace agail::hdf5
