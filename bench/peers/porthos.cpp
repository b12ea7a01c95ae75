#include "bench/peers/subject.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/derivatives/dynamics_derivatives.h"
#include "mechanics/derivatives/field_tangent.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"

namespace porthos::bench {
namespace {

/// All second derivatives of H: the field's tangent along every unit vector, one in each lane.
struct Hessian {
  static constexpr int lanes = phs::native_lanes == 8 ? 8 : 4;
  using Lanes = phs::Pack<double, lanes>;
  using Numbers = std::vector<Lanes>;

  explicit Hessian(const Case& c)
      : n(size_t(c.model->nq())), model(c.model), tangent(*model), field(2 * n) {
    mechanics::Workspace<double> w(*model);
    for (size_t s = 0; s < c.q.size(); ++s) {
      Vec p(n);
      mechanics::momenta_from_rates<double>(*model, w, c.q[s], c.v[s], p);
      q.emplace_back(c.q[s].begin(), c.q[s].end());
      momenta.emplace_back(p.begin(), p.end());
    }
    for (size_t from = 0; from < 2 * n; from += lanes) {
      direction.emplace_back(2 * n, Lanes(0.0));
      for (size_t l = 0; l < lanes && from + l < 2 * n; ++l)
        direction.back()[from + l].set(int(l), 1);
      columns.emplace_back(2 * n);
    }
  }
  void operator()(int i) {
    const auto first = [&](auto& x) { return std::span(x).first(n); };
    const auto last = [&](auto& x) { return std::span(x).last(n); };
    tangent.at(q[size_t(i)], momenta[size_t(i)], first(field), last(field));
    for (size_t d = 0; d < direction.size(); ++d) {
      const Numbers& x = direction[d];
      tangent.times(first(x), last(x), first(columns[d]), last(columns[d]));
    }
  }
  size_t n;
  std::shared_ptr<const mechanics::Mechanism> model;
  mechanics::FieldTangent<Lanes> tangent;
  Numbers field;
  std::vector<Numbers> q, momenta, direction, columns;
};

}  // namespace

Subject porthos_subject(const Case& c) {
  struct Run {
    explicit Run(const Case& k)
        : m(k.model),
          w(*m),
          d(*m),
          out(size_t(m->nv())),
          M(size_t(m->nv() * m->nv())),
          slopes(3 * M.size()),
          q(k.q),
          v(k.v),
          tau(k.tau) {}
    std::shared_ptr<const mechanics::Mechanism> m;
    mechanics::Workspace<double> w;
    mechanics::DerivativeWorkspace<double> d;
    Vec out, M, slopes;
    std::vector<Vec> q, v, tau;
    void aba(int i) {
      const auto s = size_t(i);
      mechanics::aba<double>(*m, w, q[s], v[s], {tau[s], {}}, out);
    }
    void rnea(int i) {
      const auto s = size_t(i);
      mechanics::rnea<double>(*m, w, q[s], v[s], tau[s], {}, out);
    }
    void crba(int i) { mechanics::crba<double>(*m, w, q[size_t(i)], M); }
    std::span<double> slope(size_t k) { return std::span(slopes).subspan(k * M.size(), M.size()); }
    void rnea_derivatives(int i) {
      const auto s = size_t(i);
      mechanics::rnea_derivatives<double>(*m, w, d, q[s], v[s], tau[s], {}, out, slope(0),
                                          slope(1));
    }
    void aba_derivatives(int i) {
      const auto s = size_t(i);
      mechanics::aba_derivatives<double>(*m, w, d, q[s], v[s], {tau[s], {}}, out, slope(0),
                                         slope(1), slope(2));
    }
  };
  auto r = std::make_shared<Run>(c);
  Subject s;
  s.name = "Porthos";
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  s.rnea_derivatives = [r](int i) { r->rnea_derivatives(i); };
  s.aba_derivatives = [r](int i) { r->aba_derivatives(i); };
  s.hessian = [h = std::make_shared<Hessian>(c)](int i) { (*h)(i); };
  s.acceleration = [r](int i) {
    r->aba(i);
    return r->out;
  };
  s.torque = [r](int i) {
    r->rnea(i);
    return r->out;
  };
  s.mass_matrix = [r](int i) {
    r->crba(i);
    return r->M;
  };
  s.torque_slopes = [r](int i) {
    r->rnea_derivatives(i);
    return Vec(r->slopes.begin(), r->slopes.begin() + std::ptrdiff_t(2 * r->M.size()));
  };
  s.acceleration_slopes = [r](int i) {
    r->aba_derivatives(i);
    return r->slopes;
  };
  return s;
}

}  // namespace porthos::bench
