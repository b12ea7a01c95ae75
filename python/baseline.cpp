// References for the tests of speed of batches: C++ loops over the same kernels.
#include <chrono>
#include <random>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "python/bind.h"

namespace porthos::python {
namespace {

namespace py = pybind11;
using namespace mechanics;
using phs::Pack8;

template <class T>
double loop(const Mechanism& m, const std::string& kernel, size_t calls, int repeats) {
  const size_t nq = size_t(m.nq()), nv = size_t(m.nv());
  Workspace<T> w(m);
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> u(-0.1, 0.1);
  const auto neutral = m.neutral();
  std::vector<T> q(calls * nq), p(calls * nq), v(calls * nv), a(calls * nq), b(calls * nq),
      M(kernel == "crba" ? calls * nv * nv : 0);
  for (size_t i = 0; i < q.size(); ++i) {
    q[i] = T(neutral[i % nq] + u(rng));
    p[i] = T(u(rng));
  }
  for (auto& x : v) x = T(u(rng));
  double best = HUGE_VAL;
  for (int r = 0; r < repeats; ++r) {
    const auto start = std::chrono::steady_clock::now();
    for (size_t i = 0; i < calls; ++i) {
      const std::span<const T> qi(&q[i * nq], nq), pi(&p[i * nq], nq), vi(&v[i * nv], nv);
      const std::span<T> ai(&a[i * nv], nv), di(&a[i * nq], nq), bi(&b[i * nq], nq);
      if (kernel == "aba")
        aba<T>(m, w, qi, vi, {vi, {}}, ai);
      else if (kernel == "rnea")
        rnea<T>(m, w, qi, vi, vi, {}, ai);
      else if (kernel == "crba")
        crba<T>(m, w, qi, {&M[i * nv * nv], nv * nv});
      else if (kernel == "hamiltonian_field")
        hamiltonian_field<T>(m, w, qi, pi, {}, di, bi);
      else if (kernel == "momenta_from_rates")
        momenta_from_rates<T>(m, w, qi, vi, di);
      else
        throw InvalidArgument("there is no kernel '" + kernel + "' to time");
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    best = std::min(best, spent.count());
  }
  return best;
}

}  // namespace

void bind_baseline(py::module_& m) {
  m.def(
      "_cpp_seconds",
      [](std::shared_ptr<const Mechanism> p, const std::string& kernel, size_t states, bool lanes,
         int repeats) {
        const py::gil_scoped_release released;
        return lanes ? loop<Pack8>(*p, kernel, states / 8, repeats)
                     : loop<double>(*p, kernel, states, repeats);
      },
      py::arg("mechanism"), py::arg("kernel"), py::arg("states"), py::arg("lanes"),
      py::arg("repeats"),
      "Least time of a C++ loop over so many states [s]; in lanes: states laid out in packs "
      "already.");
}

}  // namespace porthos::python
