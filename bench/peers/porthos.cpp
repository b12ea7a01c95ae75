#include "bench/peers/subject.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/rnea.h"

namespace porthos::bench {

Subject porthos_subject(const Case& c) {
  struct Run {
    explicit Run(const Case& k)
        : m(k.model),
          w(*m),
          out(size_t(m->nv())),
          M(size_t(m->nv() * m->nv())),
          q(k.q),
          v(k.v),
          tau(k.tau) {}
    std::shared_ptr<const mechanics::Mechanism> m;
    mechanics::Workspace<double> w;
    Vec out, M;
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
  };
  auto r = std::make_shared<Run>(c);
  Subject s;
  s.name = "Porthos";
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
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
  return s;
}

}  // namespace porthos::bench
