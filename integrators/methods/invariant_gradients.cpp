#include "integrators/methods/invariant_gradients.h"

#include <cmath>

namespace porthos::integrators {
namespace {

using Vec = std::vector<double>;

/// Gradients of all invariants at a point, with one dual evaluation per relevant coordinate.
class Probe {
 public:
  explicit Probe(const phs::Model& model)
      : system_(model.instantiate<phs::Dual>()),
        x_(size_t(model.description().nx)),
        values_(size_t(model.description().invariant_count())) {}

  std::vector<Vec> operator()(const Vec& x, const std::vector<size_t>& coordinates) {
    std::vector<Vec> gradients(values_.size(), Vec(x.size(), 0.0));
    x_.assign(x.begin(), x.end());
    for (const size_t k : coordinates) {
      x_[k].d = 1;
      system_->invariants(x_, values_);
      x_[k].d = 0;
      for (size_t i = 0; i < values_.size(); ++i) gradients[i][k] = values_[i].d;
    }
    return gradients;
  }

 private:
  std::unique_ptr<phs::System<phs::Dual>> system_;
  std::vector<phs::Dual> x_, values_;
};

double largest(const Vec& v) {
  double m = 0;
  for (const double x : v) m = std::max(m, std::fabs(x));
  return m;
}

/// The coordinates that the invariants depend on: those with a slope at a generic point.
std::vector<size_t> active(Probe& probe, const phs::Description& d) {
  std::vector<size_t> all(size_t(d.nx)), found;
  Vec x(all.size());
  for (size_t k = 0; k < all.size(); ++k) {
    all[k] = k;
    x[k] = std::sin(double(k + 1));
  }
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::rotation)
      for (size_t k = 0; k < 4; ++k) x[size_t(b.at) + k] = 0.5;
  const auto gradients = probe(x, all);
  for (const size_t k : all) {
    bool matters = false;
    for (const Vec& g : gradients) matters |= std::fabs(g[k]) > 1e-12 * largest(g);
    if (matters) found.push_back(k);
  }
  return found;
}

}  // namespace

InvariantGradients::InvariantGradients(const phs::Model& model) {
  const auto& d = model.description();
  if (d.invariants.empty()) return;
  Probe probe(model);
  const auto coordinates = active(probe, d);

  Vec x(size_t(d.nx), 0.0);  // here the entries are exact: ½, 1, …
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::rotation) x[size_t(b.at)] = 1;
  auto a = probe(x, coordinates);
  std::vector<std::vector<Entry>> A(a.size());
  for (const size_t j : coordinates) {
    Vec y = x;
    y[j] += 1;
    const auto g = probe(y, coordinates);
    for (size_t i = 0; i < g.size(); ++i)
      for (const size_t k : coordinates) {
        const double slope = g[i][k] - a[i][k];
        if (std::fabs(slope) > 1e-12 * largest(g[i])) A[i].push_back({k, j, slope});
      }
  }
  for (size_t i = 0; i < a.size(); ++i)
    for (const auto& e : A[i]) a[i][e.row] -= e.value * x[e.column];

  for (const auto& c : d.invariants)
    for (int i = c.at; i < c.at + c.size; ++i)
      if (c.degree == 1 || c.degree == 2) {
        a_.push_back(std::move(a[size_t(i)]));
        A_.push_back(std::move(A[size_t(i)]));
      }
}

}  // namespace porthos::integrators
