#pragma once
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "mechanics/derivatives/dynamics_derivatives.h"
#include "mechanics/mechanism.h"
#include "python/arrays.h"
#include "python/lanes.h"

/// Kernels of a mechanism over one state or many.
namespace porthos::python {

using SharedMechanism = std::shared_ptr<const mechanics::Mechanism>;

/// The scratch of the kernels, kept between calls: one per thread for each of the last few
/// mechanisms.
struct Scratch {
  explicit Scratch(const SharedMechanism& m)
      : mechanism(m), one(*m), eight(*m), of_one(*m), of_eight(*m) {}
  std::weak_ptr<const mechanics::Mechanism> mechanism;
  mechanics::Workspace<double> one;
  mechanics::Workspace<phs::Pack8> eight;
  mechanics::DerivativeWorkspace<double> of_one;
  mechanics::DerivativeWorkspace<phs::Pack8> of_eight;
  std::vector<double> numbers;
  std::vector<phs::Pack8> packs;
  std::vector<mechanics::Force<double>> wrench;
  std::vector<mechanics::Force<phs::Pack8>> wrenches;
  std::vector<mechanics::Transform<double>> pose;
  std::vector<mechanics::Transform<phs::Pack8>> poses;

  template <class T>
  mechanics::DerivativeWorkspace<T>& derivatives() {
    if constexpr (std::is_same_v<T, double>)
      return of_one;
    else
      return of_eight;
  }
  template <class T>
  auto& pick(auto& of_double, auto& of_packs, size_t n) {
    auto& v = [&]() -> auto& {
      if constexpr (std::is_same_v<T, double>)
        return of_double;
      else
        return of_packs;
    }
    ();
    if (v.size() < n) v.resize(n);
    return v;
  }
};

inline Scratch& scratch_of(const SharedMechanism& m) {
  constexpr size_t most = 8;
  thread_local std::vector<std::unique_ptr<Scratch>> kept;
  for (size_t i = 0; i < kept.size(); ++i)
    if (kept[i]->mechanism.lock() == m) {
      if (i > 0) std::swap(kept[0], kept[i]);
      return *kept[0];
    }
  if (kept.size() == most) kept.pop_back();
  kept.insert(kept.begin(), std::make_unique<Scratch>(m));
  return *kept[0];
}

/// Runs f(scratch, workspace, in, out) over the rows: a generic callable with spans over double or
/// phs::Pack8.
template <size_t I, size_t O, class F>
void over_rows(const SharedMechanism& m, const Rows& rows, const std::array<Source, I>& in,
               const std::array<Target, O>& out, F f) {
  Scratch& s = scratch_of(m);
  Lanes<I, O> lanes(in, out);
  const auto work = [&] {
    lanes.run(
        rows.count(),
        [&](const auto& a, const auto& b) { f.template operator()<double>(s, s.one, a, b); },
        [&](const auto& a, const auto& b) { f.template operator()<phs::Pack8>(s, s.eight, a, b); });
  };
  if (rows.count() < 32) return work();
  const py::gil_scoped_release released;
  work();
}

/// One array of numbers of the shape `item` for each state.
template <size_t I, class F>
py::array_t<double> one_array(const SharedMechanism& m, Rows& rows, const std::array<Source, I>& in,
                              py::handle out, const Shape& item, F f) {
  auto y = rows.out("out", out, item);
  over_rows(m, rows, in, std::array{Target{y.mutable_data(), size_of(item)}}, f);
  return y;
}

inline size_t nq(const SharedMechanism& m) { return size_t(m->nq()); }
inline size_t nv(const SharedMechanism& m) { return size_t(m->nv()); }

/// A pair of outputs: None, or a tuple of two.
inline std::pair<py::object, py::object> two(py::handle out) {
  if (out.is_none()) return {py::none(), py::none()};
  if (!py::isinstance<py::tuple>(out) || py::len(out) != 2)
    throw InvalidArgument("out is " + kind_of(out) + ", expected a tuple of two arrays");
  const auto t = py::reinterpret_borrow<py::tuple>(out);
  return {t[0], t[1]};
}

}  // namespace porthos::python
