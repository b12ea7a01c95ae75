#include "scene/files/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "phs/error.h"
#include "scene/files/digest.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_id-inl.h"

namespace porthos::scene {
namespace {

constexpr hsize_t rows_per_chunk = 4096;
constexpr unsigned deflate_level = 4;

/// No times, so that equal content gives equal bytes. Names and attributes lie in the headers of
/// their objects, which have checksums: HDF5 1.10 crashes where its heaps of names are damaged.
hid_t creating(hid_t kind) {
  const hid_t p = H5Pcreate(kind);
  H5Pset_obj_track_times(p, false);
  H5Pset_attr_phase_change(p, 65535, 0);
  if (kind != H5P_DATASET_CREATE) H5Pset_link_phase_change(p, 65535, 0);
  return p;
}

hid_t string_type(const std::string& text) {
  const hid_t t = H5Tcopy(H5T_C_S1);
  H5Tset_size(t, std::max<size_t>(1, text.size()));
  H5Tset_strpad(t, H5T_STR_NULLPAD);
  H5Tset_cset(t, H5T_CSET_UTF8);
  return t;
}

/// What a reader gets: zeros at the end of a text are padding.
std::string_view without_padding(std::string_view text) {
  return text.substr(0, text.find_last_not_of('\0') + 1);
}

bool write_attribute(hid_t object, const std::string& name, hid_t type, const void* value) {
  const Owned space(H5Screate(H5S_SCALAR));
  const Owned a(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT));
  return a.ok() && H5Awrite(a, type, value) >= 0;
}
bool write_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Owned type(string_type(text));
  return write_attribute(object, name, type, text.c_str());  // c_str: one zero byte even when empty
}
bool write_attribute(hid_t object, const std::string& name, double value) {
  return write_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
}

}  // namespace

Hdf5File::Hdf5File(const std::filesystem::path& path) : path_(path) {
  const Hdf5Turn turn;
  prepare_hdf5();
  // The format of HDF5 1.10 has checksums of headers, links, attributes and indices of chunks.
  const Owned create(creating(H5P_FILE_CREATE)), access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  errno = 0;
  file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, create, access);
  require(file_ >= 0);
}

Hdf5File::~Hdf5File() {
  const Hdf5Turn turn;
  if (file_ >= 0) H5Fclose(file_);
}

void Hdf5File::require(bool ok) const {
  if (ok) return;
  if (errno != 0) cannot_write(path_);
  throw IoError(fmt::format("cannot write {}: the HDF5 library refused", path_.string()));
}

void Hdf5File::group(const std::string& name) {
  const Hdf5Turn turn;
  const Owned create(creating(H5P_GROUP_CREATE));
  const Owned g(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, create, H5P_DEFAULT));
  require(g.ok());
}

Hdf5File::Dataset Hdf5File::dataset(const std::string& name, std::int64_t rows,
                                    std::int64_t columns, Kind kind) {
  const Hdf5Turn turn;
  const int rank = columns > 0 ? 2 : 1;
  const hsize_t shape[2] = {hsize_t(rows), hsize_t(columns)};
  const hsize_t chunk[2] = {std::clamp<hsize_t>(hsize_t(rows), 1, rows_per_chunk),
                            hsize_t(columns)};
  const Owned space(H5Screate_simple(rank, shape, nullptr));
  const Owned create(creating(H5P_DATASET_CREATE));
  if (rows > 0) {
    H5Pset_chunk(create, rank, chunk);
    H5Pset_shuffle(create);
    H5Pset_deflate(create, deflate_level);
    H5Pset_fletcher32(create);
  }
  const hid_t type = kind == Kind::real ? H5T_IEEE_F64LE : H5T_STD_I64LE;
  const Owned access(H5Pcreate(H5P_DATASET_ACCESS));
  H5Pset_chunk_cache(access, 1, 0, 1);  // whole chunks are written once: a cache has no use
  const hid_t id = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, create, access);
  require(id >= 0);
  return Dataset(this, id, columns);
}

Hdf5File::Dataset::~Dataset() {
  if (id_ < 0) return;
  const Hdf5Turn turn;
  errno = 0;
  if (H5Dclose(id_) < 0) file_->failed_ = errno != 0 ? errno : -1;
}

void Hdf5File::Dataset::write_rows(std::int64_t first_row, std::size_t count, const void* values,
                                   Id type) {
  if (count == 0) return;
  const Hdf5Turn turn;
  const int rank = columns_ > 0 ? 2 : 1;
  const hsize_t rows = count / hsize_t(std::max<std::int64_t>(1, columns_));
  const hsize_t start[2] = {hsize_t(first_row), 0}, shape[2] = {rows, hsize_t(columns_)};
  const Owned all(H5Dget_space(id_)), part(H5Screate_simple(rank, shape, nullptr));
  H5Sselect_hyperslab(all, H5S_SELECT_SET, start, nullptr, shape, nullptr);
  file_->require(H5Dwrite(id_, type, part, all, H5P_DEFAULT, values) >= 0);
}
void Hdf5File::Dataset::write(std::int64_t first_row, std::span<const double> v) {
  write_rows(first_row, v.size(), v.data(), H5T_NATIVE_DOUBLE);
}
void Hdf5File::Dataset::write(std::int64_t first_row, std::span<const std::int64_t> v) {
  write_rows(first_row, v.size(), v.data(), H5T_NATIVE_INT64);
}
void Hdf5File::Dataset::attribute(const std::string& name, const std::string& text) {
  const Hdf5Turn turn;
  file_->require(write_attribute(id_, name, text));
}
void Hdf5File::Dataset::attribute(const std::string& name, double value) {
  const Hdf5Turn turn;
  file_->require(write_attribute(id_, name, value));
}

void Hdf5File::text(const std::string& name, const std::string& content) {
  const Hdf5Turn turn;
  const Owned type(string_type(content)), space(H5Screate(H5S_SCALAR)),
      create(creating(H5P_DATASET_CREATE));
  const Dataset d(
      this, H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, create, H5P_DEFAULT), 0);
  require(d.id_ >= 0 &&
          H5Dwrite(d.id_, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, content.c_str()) >= 0 &&
          write_attribute(d.id_, "sha256", sha256(without_padding(content))));
}

void Hdf5File::attribute(const std::string& object, const std::string& name,
                         const std::string& text) {
  const Hdf5Turn turn;
  const Owned o(H5Oopen(file_, object.c_str(), H5P_DEFAULT));
  require(o.ok() && write_attribute(o, name, text));
}
void Hdf5File::attribute(const std::string& object, const std::string& name, double value) {
  const Hdf5Turn turn;
  const Owned o(H5Oopen(file_, object.c_str(), H5P_DEFAULT));
  require(o.ok() && write_attribute(o, name, value));
}

void Hdf5File::close() {
  const Hdf5Turn turn;
  const hid_t file = file_;
  file_ = -1;
  errno = 0;
  require(H5Fclose(file) >= 0);
  if (failed_ != 0) {
    errno = std::max(failed_, 0);
    require(false);
  }
  sync_to_disk(path_);
}

std::string link_name(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace porthos::scene
