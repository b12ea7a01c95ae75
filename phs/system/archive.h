#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "phs/error.h"
#include "phs/scalars/scalar.h"

namespace porthos {

/// What must survive a restart, as a list of doubles. A class names its numbers once, in a function
/// `carry(Archive&)`. That function counts, saves and loads them, so order and size cannot differ.
class Archive {
 public:
  /// Counts the numbers.
  Archive() = default;
  /// Appends them to `to`; allocates only if its capacity is too small.
  explicit Archive(std::vector<double>& to) : to_(&to) {}
  /// Reads them from the front of `from`.
  explicit Archive(std::span<const double> from) : from_(from), loads_(true) {}

  bool loads() const { return loads_; }
  std::size_t size() const { return size_; }

  void operator()(double& x) {
    one(x, [&](double y) { x = y; });
  }
  void operator()(bool& x) {
    one(x, [&](double y) { x = y != 0; });
  }
  /// Whole numbers. @throws InvalidArgument if a loaded one is not in [least, most]
  void operator()(int& x, double least = -1e9, double most = 1e9) {
    one(x, [&](double y) { x = whole(y, least, most); });
  }
  void operator()(std::int64_t& x, double least = -0x1p53, double most = 0x1p53) {
    one(double(x), [&](double y) { x = whole<std::int64_t>(y, least, most); });
  }
  /// Other scalars are stored as the nearest double.
  void operator()(phs::Quad& x) {
    one(phs::to_double(x), [&](double y) { x = y; });
  }
  void operator()(phs::Dual& x) {
    one(phs::to_double(x), [&](double y) { x = phs::Dual(y); });
  }
  template <class T>
  void operator()(std::vector<T>& all) {
    for (T& x : all) (*this)(x);
  }
  template <class T>
  void operator()(std::span<T> all) {
    for (T& x : all) (*this)(x);
  }

 private:
  template <class Set>
  void one(double x, const Set& set) {
    ++size_;
    if (to_) to_->push_back(x);
    if (!loads_) return;
    require_some();
    set(from_.front());
    from_ = from_.subspan(1);
  }
  void require_some() const {
    if (from_.empty()) require_size("memory to load", size_ - 1, size_);
  }

  std::vector<double>* to_ = nullptr;
  std::span<const double> from_;
  bool loads_ = false;
  std::size_t size_ = 0;
};

/// Saves what an object carries. Its carry(Archive&) does not change the object here.
template <class X>
void save_carried(const X& object, std::vector<double>& to) {
  Archive a(to);
  const_cast<X&>(object).carry(a);
}
/// Loads what save_carried() saved. @param from  those numbers; `what` names them in an error
/// @throws InvalidArgument if its size does not fit
template <class X>
void load_carried(X& object, std::span<const double> from, const char* what) {
  Archive count;
  object.carry(count);
  require_size(what, from.size(), count.size());
  Archive a(from);
  object.carry(a);
}

}  // namespace porthos
