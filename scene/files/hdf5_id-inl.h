#pragma once
#include <hdf5.h>

#include <mutex>

/// For the two files that call HDF5; no public header includes it.
namespace porthos::scene {

/// Held by every function that calls HDF5: as Debian builds it, the library has no locks, and
/// threads may run scenes of their own.
class Hdf5Turn {
 public:
  Hdf5Turn() : lock_(mutex()) {}

 private:
  static std::recursive_mutex& mutex() {
    static std::recursive_mutex one;
    return one;
  }
  std::lock_guard<std::recursive_mutex> lock_;
};

/// Before the first call of whoever opens a file.
inline void prepare_hdf5() {
  // After a failed close, HDF5 before 1.14 fails in its exit handler on a file it has already freed
  // (h5py issue 914). So the handler is not installed; the owners close our files.
  static const bool no_exit_handler = H5dont_atexit() >= 0;
  static_cast<void>(no_exit_handler);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are thrown, not printed
}

/// Closes an id of any kind.
class Owned {
 public:
  explicit Owned(hid_t id) : id_(id) {}
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }

 private:
  hid_t id_;
};

}  // namespace porthos::scene
