#pragma once
#include <hdf5.h>

/// For the two files that call HDF5; no public header includes it.
namespace porthos::scene {

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
