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
