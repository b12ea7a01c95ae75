#include "scene/files/hdf5_reader.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <exception>
#include <functional>

#include "phs/error.h"
#include "scene/files/digest.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_id-inl.h"

namespace porthos::scene {
namespace {

constexpr unsigned longest_trial = 60;  // [s]; a list of 10 000 datasets takes less than one

/// An unknown file may declare any size. Memory is allocated only for as much data as the stored
/// bytes can hold (deflate compresses at most 1032 times).
bool is_filled(hid_t data, hid_t type, const std::vector<hsize_t>& shape) {
  double bytes = double(H5Tget_size(type));
  for (const hsize_t n : shape) bytes *= double(n);
  return bytes <= 1032.0 * double(H5Dget_storage_size(data));
}

/// Describes a dataset; false if Hdf5File does not write such a dataset.
bool describe(hid_t data, Hdf5Reader::Dataset& d) {
  using Kind = Hdf5Reader::Kind;
  const Owned type(H5Dget_type(data)), space(H5Dget_space(data));
  if (!type.ok() || !space.ok()) return false;
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      d.kind = Kind::real;
      break;
    case H5T_INTEGER:
      d.kind = Kind::integer;
      break;
    case H5T_STRING:
      d.kind = Kind::text;
      break;
    default:
      return false;
  }
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0 || rank > 2) return false;
  std::vector<hsize_t> n(size_t(rank), 0);
  if (rank > 0 && H5Sget_simple_extent_dims(space, n.data(), nullptr) < 0) return false;
  d.shape.assign(n.begin(), n.end());
  d.filled = is_filled(data, type, n);
  return true;
}

/// The single text of fixed length that `read` reads, without its zero padding.
std::string fixed_text(hid_t type, hid_t space, const std::function<herr_t(void*)>& read) {
  if (H5Tis_variable_str(type) != 0 || H5Sget_simple_extent_npoints(space) != 1) return {};
  std::string text(H5Tget_size(type), '\0');
  if (read(text.data()) < 0) return {};
  text.resize(text.find_last_not_of('\0') + 1);
  return text;
}

/// Calls f(name, attribute, type) for every attribute of an object.
bool each_attribute(hid_t file, const std::string& object,
                    const std::function<void(const std::string&, hid_t, hid_t)>& f) {
  const Owned o(H5Oopen(file, object.c_str(), H5P_DEFAULT));
  if (!o.ok()) return false;
  const auto visit = [](hid_t at, const char* name, const H5A_info_t*, void* with) -> herr_t {
    const Owned a(H5Aopen(at, name, H5P_DEFAULT)), type(a.ok() ? H5Aget_type(a) : -1);
    if (!type.ok()) return -1;
    (*static_cast<const std::function<void(const std::string&, hid_t, hid_t)>*>(with))(name, a,
                                                                                       type);
    return 0;
  };
  hsize_t from = 0;
  return H5Aiterate2(o, H5_INDEX_NAME, H5_ITER_INC, &from, visit,
                     const_cast<void*>(static_cast<const void*>(&f))) >= 0;
}

/// Adds every dataset of a file to a list. @returns whether the structure of the file could be read
bool list_datasets(hid_t file, std::map<std::string, Hdf5Reader::Dataset>& list) {
  const auto visit = [](hid_t root, const char* name, const H5O_info_t* info, void* to) -> herr_t {
    if (info->type != H5O_TYPE_DATASET) return 0;
    const Owned data(H5Dopen2(root, name, H5P_DEFAULT));
    Hdf5Reader::Dataset d;
    if (!data.ok()) return -1;
    if (describe(data, d)) static_cast<decltype(&list)>(to)->emplace(name, d);
    return 0;
  };
  return H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, visit, &list, H5O_INFO_BASIC) >= 0;
}

/// Whether the HDF5 library comes through the structure of a file. On some damaged files 1.10
/// crashes, so this is tried in a process of its own.
bool is_survived(const std::filesystem::path& path) {
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
  // Its child of a program with threads may wait for ever: about one of ten runs of the test that
  // reads files in four of them. The file is then read without the trial.
  return true;
#endif
#endif
  const pid_t child = fork();
  if (child < 0) return true;  // no process is to be had: the file is read without the trial
  if (child == 0) {
    for (const int fatal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL}) std::signal(fatal, SIG_DFL);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    alarm(longest_trial);
    std::set_terminate([] { _exit(0); });  // missing memory is for the program to tell
    try {
      if (const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT); file >= 0) {
        std::map<std::string, Hdf5Reader::Dataset> list;
        list_datasets(file, list);
        for (const auto& [name, d] : list) each_attribute(file, name, [](auto&&...) {});
      }
    } catch (...) {
    }
    _exit(0);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return !WIFSIGNALED(status);
}

}  // namespace

std::int64_t Hdf5Reader::Dataset::size() const {
  std::int64_t n = 1;
  for (const auto k : shape) n *= k;
  return n;
}

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path) : path_(path) {
  const Hdf5Turn turn;
  prepare_hdf5();
  if (!std::filesystem::exists(path)) refuse("there is no such file");
  if (!is_survived(path)) refuse("it is damaged: the HDF5 library dies of it");
  file_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file_ < 0) refuse("it is cut off, damaged or no HDF5 file");
  if (!list_datasets(file_, datasets_)) {
    H5Fclose(file_);
    refuse("its contents are damaged");
  }
}

Hdf5Reader::~Hdf5Reader() {
  const Hdf5Turn turn;
  H5Fclose(file_);
}

void Hdf5Reader::refuse(const std::string& why) const {
  throw InvalidArgument(fmt::format("cannot read {}: {}", path_.string(), why));
}

const Hdf5Reader::Dataset& Hdf5Reader::dataset(const std::string& name) const {
  if (const auto d = datasets_.find(name); d != datasets_.end()) {
    if (!d->second.filled)
      refuse(
          fmt::format("dataset '{}' is damaged: it is declared larger than what is there", name));
    return d->second;
  }
  std::string known;
  for (const auto& [other, d] : datasets_) add_to_list(known, other);
  refuse(fmt::format("it has no dataset '{}', expected one of: {}", name, known));
}

void Hdf5Reader::read(const std::string& name, double* to) const {
  const Hdf5Turn turn;
  dataset(name);
  const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT));
  if (!d.ok() || H5Dread(d, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) < 0)
    refuse(fmt::format("dataset '{}' is damaged", name));
}
void Hdf5Reader::read(const std::string& name, std::int64_t* to) const {
  const Hdf5Turn turn;
  dataset(name);
  const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT));
  if (!d.ok() || H5Dread(d, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) < 0)
    refuse(fmt::format("dataset '{}' is damaged", name));
}

void Hdf5Reader::read_rows(const std::string& name, std::int64_t first, std::int64_t rows,
                           double* to) const {
  const Hdf5Turn turn;
  const auto& shape = dataset(name).shape;
  if (shape.empty() || first < 0 || rows < 0 || rows > shape[0] - first)
    refuse(fmt::format("dataset '{}' has no records {} to {}", name, first, first + rows));
  const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT)), all(d.ok() ? H5Dget_space(d) : -1);
  const hsize_t start[2] = {hsize_t(first), 0},
                size[2] = {hsize_t(rows), shape.size() > 1 ? hsize_t(shape[1]) : 1};
  const Owned part(H5Screate_simple(int(shape.size()), size, nullptr));
  if (!all.ok() || H5Sselect_hyperslab(all, H5S_SELECT_SET, start, nullptr, size, nullptr) < 0 ||
      H5Dread(d, H5T_NATIVE_DOUBLE, part, all, H5P_DEFAULT, to) < 0)
    refuse(fmt::format("dataset '{}' is damaged from record {} on", name, first));
}

std::string Hdf5Reader::text(const std::string& name) const {
  const Hdf5Turn turn;
  dataset(name);
  const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT)), type(d.ok() ? H5Dget_type(d) : -1),
      space(d.ok() ? H5Dget_space(d) : -1);
  if (!type.ok() || !space.ok() || H5Tget_class(type) != H5T_STRING)
    refuse(fmt::format("dataset '{}' is damaged, expected a text", name));
  const std::string all = fixed_text(
      type, space, [&](void* to) { return H5Dread(d, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to); });
  const auto about = texts(name);
  if (const auto digest = about.find("sha256");
      digest != about.end() && digest->second != sha256(all))
    refuse(fmt::format("dataset '{}' is damaged: its checksum does not fit", name));
  return all;
}

std::map<std::string, std::string> Hdf5Reader::texts(const std::string& object) const {
  const Hdf5Turn turn;
  std::map<std::string, std::string> all;
  const auto add = [&](const std::string& name, hid_t a, hid_t type) {
    const Owned space(H5Aget_space(a));
    if (H5Tget_class(type) == H5T_STRING && space.ok())
      all[name] = fixed_text(type, space, [&](void* to) { return H5Aread(a, type, to); });
  };
  if (!each_attribute(file_, object, add)) refuse(fmt::format("it has no '{}'", object));
  return all;
}

std::map<std::string, double> Hdf5Reader::numbers(const std::string& object) const {
  const Hdf5Turn turn;
  std::map<std::string, double> all;
  const auto add = [&](const std::string& name, hid_t a, hid_t type) {
    double x = 0;
    const Owned space(H5Aget_space(a));
    if (H5Tget_class(type) == H5T_FLOAT && space.ok() && H5Sget_simple_extent_npoints(space) == 1 &&
        H5Aread(a, H5T_NATIVE_DOUBLE, &x) >= 0)
      all[name] = x;
  };
  if (!each_attribute(file_, object, add)) refuse(fmt::format("it has no '{}'", object));
  return all;
}

std::vector<std::filesystem::path> series_files(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "run.h5")) return {folder / "run.h5"};
  std::vector<std::filesystem::path> all;
  const auto next = [&] { return phase_folder(folder, all.size() + 1) / "run.h5"; };
  while (std::filesystem::exists(next())) all.push_back(next());
  if (all.empty())
    throw InvalidArgument(
        fmt::format("{} has no run.h5, expected the results of a run", folder.string()));
  return all;
}

}  // namespace porthos::scene
