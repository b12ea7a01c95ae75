#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "phs/scalars/derivative.h"
#include "phs/system/system.h"

namespace porthos::planning {

/// x' = f(t, x, u) with its first and second derivatives, at several points at once: the stages of
/// a step. Arrays hold one point after another: t has `count` numbers, x count · nx, u count · nu.
/// One object per thread; after the first call with a count nothing allocates.
class Dynamics {
 public:
  using In = std::span<const double>;
  using Out = std::span<double>;

  virtual ~Dynamics() = default;
  int nx() const { return nx_; }
  int nu() const { return nu_; }

  /// f, count · nx numbers.
  virtual void field(In t, In x, In u, Out f) = 0;
  /// f and J = [∂f/∂x ∂f/∂u], at each point an nx × (nx + nu) matrix by columns.
  virtual void jacobian(In t, In x, In u, Out f, Out J) = 0;
  /// H = ∇²(λᵀf) along (x, u), at each point a symmetric matrix of size nx + nu.
  /// @param lambda  count · nx
  virtual void hessian(In t, In x, In u, In lambda, Out H) = 0;

 protected:
  Dynamics(int nx, int nu) : nx_(nx), nu_(nu) {}

 private:
  int nx_, nu_;
};

/// The dynamics of a model whose inputs at the named ports are planned; its other inputs are 0.
/// First derivatives are the system's own products (phs::linearise), several stages and directions
/// in the lanes of a machine register. Second ones are central differences of the transposed
/// products, with an error of about 1e-10 of their size: they only decide how fast the solver
/// converges, not where to.
/// @param ports  of one number each, such as "shoulder.torque"; their order is that of u
/// @throws InvalidArgument for an unknown port, one of several numbers or one whose input does not
///   just add to one momentum; a model with constraints or sampled controllers
std::unique_ptr<Dynamics> dynamics_of(std::shared_ptr<const phs::Model> model,
                                      const std::vector<std::string>& ports);

/// Dynamics given by a function f(t, x, u, dx) for every scalar, with exact derivatives by duals:
/// function_dynamics(2, 1, [](auto t, auto x, auto u, auto dx) { dx[0] = x[1]; dx[1] = u[0]; }).
/// x, u and dx are spans, t is a double.
template <class F>
std::unique_ptr<Dynamics> function_dynamics(int nx, int nu, F f) {
  using D = phs::Dual;
  using DD = phs::BasicDual<D>;
  class OfFunction final : public Dynamics {
   public:
    OfFunction(int nx, int nu, F f)
        : Dynamics(nx, nu), f_(std::move(f)), d_(size_t(nx + nu)), dd_(d_.size()) {
      dx_.resize(size_t(nx));
      ddx_.resize(size_t(nx));
    }
    void field(In t, In x, In u, Out f) override {
      const size_t n = size_t(nx()), m = size_t(nu());
      for (size_t p = 0; p < t.size(); ++p)
        f_(t[p], x.subspan(p * n, n), u.subspan(p * m, m), f.subspan(p * n, n));
    }
    void jacobian(In t, In x, In u, Out f, Out J) override {
      const size_t n = size_t(nx()), m = size_t(nu());
      const std::span<const D> z1(d_);
      for (size_t p = 0; p < t.size(); ++p) {
        for (size_t k = 0; k < n + m; ++k) d_[k] = D(k < n ? x[p * n + k] : u[p * m + k - n]);
        phs::along_each(d_, [&](size_t k) {
          f_(t[p], z1.first(n), z1.subspan(n), std::span<D>(dx_));
          for (size_t i = 0; i < n; ++i) {
            J[(p * (n + m) + k) * n + i] = dx_[i].d;
            f[p * n + i] = dx_[i].v;
          }
        });
      }
    }
    void hessian(In t, In x, In u, In lambda, Out H) override {
      const size_t n = size_t(nx()), m = size_t(nu()), z = n + m;
      const std::span<const DD> z2(dd_);
      for (size_t p = 0; p < t.size(); ++p) {
        for (size_t k = 0; k < z; ++k) dd_[k] = DD(D(k < n ? x[p * n + k] : u[p * m + k - n]));
        for (size_t a = 0; a < z; ++a)
          for (size_t b = 0; b <= a; ++b) {
            dd_[a].v.d = 1;
            dd_[b].d.v = 1;
            f_(t[p], z2.first(n), z2.subspan(n), std::span<DD>(ddx_));
            double sum = 0;
            for (size_t i = 0; i < n; ++i) sum += lambda[p * n + i] * ddx_[i].d.d;
            H[(p * z + a) * z + b] = H[(p * z + b) * z + a] = sum;
            dd_[a].v.d = 0;
            dd_[b].d.v = 0;
          }
      }
    }

   private:
    F f_;
    std::vector<D> d_, dx_;
    std::vector<DD> dd_, ddx_;
  };
  return std::make_unique<OfFunction>(nx, nu, std::move(f));
}

}  // namespace porthos::planning
