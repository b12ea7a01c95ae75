#include <fmt/format.h>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/interconnection.h"
#include "phs/functions/tank.h"
#include "phs/system/forwarding.h"

namespace porthos::energy_shaping {
namespace {

class TankedModel final : public phs::ModelFor<TankedModel> {
 public:
  TankedModel(std::shared_ptr<const phs::Model> of, const std::string& port, phs::LawPtr kappa,
              const TankOptions& options)
      : plant(std::move(of)), law(std::move(kappa)), tank(options) {
    description_ = plant->description();
    const auto rows = port_offsets(description_, {port});
    at = size_t(rows[0]);
    size = rows.size();
    const auto refuse = [&](const std::string& why) {
      throw InvalidArgument("tank of '" + description_.name + "': " + why);
    };
    if (!law) refuse("the law is null");
    if (!(tank.least >= 0 && tank.least < tank.most && tank.level >= tank.least &&
          tank.level <= tank.most))
      refuse(fmt::format("expected 0 <= least <= level <= most, has {}, {}, {}", tank.least,
                         tank.level, tank.most));
    if (!(tank.damping >= 0) || !(tank.fill >= 0 && tank.fill <= 1))
      refuse(fmt::format("expected damping >= 0 and fill in [0, 1], has {} and {}", tank.damping,
                         tank.fill));
    auto& d = description_;
    d.name += " with a tank";
    for (auto& b : d.blocks)
      if (b.kind == phs::BlockKind::angle) b.kind = phs::BlockKind::linear;
    d.blocks.push_back({"tank", phs::BlockKind::linear, d.nx, 1, -1, "J", ""});
    d.nx += 1;
    d.storages.push_back("tank");
    d.powers.push_back({"port damping", phs::PowerKind::dissipated});
    d.powers.push_back({"valve", phs::PowerKind::dissipated});
    d.flows.clear();
    d.invariants.clear();
    d.traits.canonical = d.traits.separable = d.traits.lossless = d.traits.autonomous = false;
  }
  const phs::Description& description() const override { return description_; }
  std::vector<phs::HoldPtr> holds() const override { return plant->holds(); }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  std::shared_ptr<const phs::Model> plant;
  phs::LawPtr law;
  TankOptions tank;
  size_t at = 0, size = 0;

 private:
  phs::Description description_;
};

template <class T>
class TankedSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit TankedSystem(const TankedModel& m)
      : phs::Forwarding<T>(m.plant->instantiate<T>(), m.description()),
        m_(m),
        plant_(this->inner()),
        n_(this->inner_size()),
        u_(size_t(m.description().nu), T(0.0)),
        y_(u_.size()),
        e_(n_ + 1),
        own_(n_),
        c_(n_),
        w_(n_),
        kappa_(m.size) {}
  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<TankedSystem>(m_));
  }
  T hamiltonian(In x) override { return plant_.hamiltonian(x.first(n_)) + x[n_]; }
  void gradient(In x, Out e) override {
    plant_.gradient(x.first(n_), e.first(n_));
    e[n_] = T(1.0);
  }
  void efforts(T, In x, In, Out e) override { gradient(x, e); }
  void stored(In x, Out values) override {
    phs::Forwarding<T>::stored(x, values);
    values[this->inner_storages()] = x[n_];
  }
  void field(T t, In x, In u, Out dx) override {
    gradient(x, e_);
    rate(t, x, e_, dx);
    if (u.empty()) return;
    plant_.apply_input(x.first(n_), u, w_);
    for (size_t i = 0; i < n_; ++i) dx[i] = dx[i] + w_[i];
  }
  void rate(T t, In x, In e, Out dx) override {
    plant_.rate(t, x.first(n_), e.first(n_), dx.first(n_));
    couple(t, x);
    exchange(e, dx);
    damp(x, e);
    for (size_t i = 0; i < n_; ++i) dx[i] = dx[i] - w_[i];
    dx[n_] = dx[n_] - valve_ * e[n_];
  }
  /// The structure at t = 0 if the law depends on time; it is skew at any t.
  void apply_structure(In x, In e, Out Je) override {
    plant_.apply_structure(x.first(n_), e.first(n_), Je.first(n_));
    couple(T(0.0), x);
    exchange(e, Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    plant_.apply_dissipation(x.first(n_), e.first(n_), Re.first(n_));
    couple(T(0.0), x);
    damp(x, e);
    for (size_t i = 0; i < n_; ++i) Re[i] = Re[i] + w_[i];
    Re[n_] = valve_ * e[n_];
  }
  void powers(T t, In x, In e, Out values) override {
    const size_t own = this->inner_powers();
    phs::Forwarding<T>::powers(t, x, e, values);
    couple(t, x);
    damp(x, e);
    T lost(0.0);
    for (size_t i = 0; i < n_; ++i) lost = lost + e[i] * w_[i];
    values[own] = lost;
    values[own + 1] = valve_ * e[n_] * e[n_];
  }
  /// The law may be stiffer than the plant.
  std::unique_ptr<phs::Resolvent> resolvent() override { return nullptr; }

 private:
  /// c = G (α κ - fill d y) and the valve, at x.
  void couple(T t, In x) {
    const In own = x.first(n_);
    plant_.gradient(own, own_);
    plant_.output(own, own_, y_);
    const In y = In(y_).subspan(m_.at, m_.size);
    (*m_.law)(t, own, y, Out(kappa_));
    const auto& k = m_.tank;
    const T alpha = phs::tank_share(x[n_], k.least, k.most);
    T inflow(0.0);
    for (size_t i = 0; i < m_.size; ++i) {
      T& u = u_[m_.at + i];
      u = alpha * kappa_[i] - T(k.fill * k.damping) * y[i];
      inflow = inflow - u * y[i];
    }
    plant_.apply_input(own, u_, c_);
    valve_ = phs::tank_overflow(x[n_], k.least, k.most, inflow);
  }
  void exchange(In e, Out dx) {
    T given(0.0);
    for (size_t i = 0; i < n_; ++i) {
      dx[i] = dx[i] + c_[i] * e[n_];
      given = given + c_[i] * e[i];
    }
    dx[n_] = -given;
  }
  /// (1 - fill) G d Gᵀe, in w_.
  void damp(In x, In e) {
    plant_.output(x.first(n_), e.first(n_), y_);
    for (size_t i = 0; i < m_.size; ++i)
      u_[m_.at + i] = T((1 - m_.tank.fill) * m_.tank.damping) * y_[m_.at + i];
    plant_.apply_input(x.first(n_), u_, w_);
  }

  const TankedModel& m_;
  phs::System<T>& plant_;
  size_t n_;
  std::vector<T> u_, y_, e_, own_, c_, w_, kappa_;
  T valve_{};
};

template <class T>
std::unique_ptr<phs::System<T>> TankedModel::make_system() const {
  return std::make_unique<TankedSystem<T>>(*this);
}

}  // namespace

std::shared_ptr<const phs::Model> with_tank(std::shared_ptr<const phs::Model> plant,
                                            const std::string& port, phs::LawPtr law,
                                            const TankOptions& tank) {
  return std::make_shared<const TankedModel>(std::move(plant), port, std::move(law), tank);
}

}  // namespace porthos::energy_shaping
