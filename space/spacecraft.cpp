#include "space/spacecraft.h"

#include <fmt/format.h>

#include <algorithm>

#include "mechanics/momentum.h"
#include "mechanics/rotation.h"
#include "phs/system/constraints.h"
#include "phs/system/forwarding.h"
#include "space/plates.h"

namespace porthos::space {
namespace {

phs::Description describe(const phs::Description& internal, const Parts& parts, bool plates) {
  phs::Description d = internal;
  d.nx += 6;
  d.blocks.push_back({"orbit.position", phs::BlockKind::linear, internal.nx, 3, -1, "m", ""});
  d.blocks.push_back({"orbit.velocity", phs::BlockKind::linear, internal.nx + 3, 3, -1, "m/s", ""});
  d.traits.canonical = d.traits.separable = false;
  d.traits.autonomous = false;  // the orbit drives it: rate() is more than (J - R) e
  d.flows.clear();
  d.powers.push_back({"gravity_gradient", phs::PowerKind::supplied});
  const auto pushes = push_accounts(parts);
  d.powers.insert(d.powers.end(), pushes.begin(), pushes.end());
  if (plates) d.powers.push_back({"plates", phs::PowerKind::supplied});
  for (auto& c : d.constraints) c.reactions.clear();  // the field has no kicks: they would lie
  d.invariants.clear();
  int at = 0;
  for (auto i : internal.invariants) {
    if (i.name == "angular_momentum") continue;
    i.at = at;
    at += i.size;
    d.invariants.push_back(std::move(i));
  }
  return d;
}

template <class T>
class SpacecraftSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit SpacecraftSystem(const Spacecraft& model)
      : phs::Forwarding<T>(model.internal().instantiate<T>(), model.description()),
        model_(model),
        internal_(this->inner()),
        gradient_(model.mechanism()),
        n_(model.internal_size()),
        nq_(size_t(model.mechanism().nq())),
        pull_(nq_),
        own_(n_) {}

  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<SpacecraftSystem>(model_));
  }
  void field(T t, In x, In u, Out dx) override {
    internal_.field(t, x.first(n_), u, dx.first(n_));
    drive(x, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    internal_.rate(t, x.first(n_), e.first(n_), dx.first(n_));
    drive(x, dx);
  }
  void efforts(T t, In x, In dx, Out e) override {
    pull(x);
    std::copy_n(dx.begin(), n_, own_.begin());
    for (size_t i = 0; i < nq_; ++i) own_[nq_ + i] = own_[nq_ + i] - pull_[i];
    internal_.efforts(t, x.first(n_), own_, e.first(n_));
    this->clear(e.subspan(n_));
  }
  void powers(T t, In x, In e, Out values) override {
    phs::Forwarding<T>::powers(t, x, e, values);
    pull(x);
    T power(0.0);
    for (size_t i = 0; i < nq_; ++i) power = power + e[nq_ + i] * pull_[i];
    values[this->inner_powers()] = power;  // thrusters, torquers, plates: in the split only
  }
  void set_turn_angles(In angles) override {
    phs::Forwarding<T>::set_turn_angles(angles);
    gradient_.set_turn_angles(angles.first(size_t(model_.mechanism().angle_count())));
  }

 private:
  Vec3<T> position(In x) const { return {x[n_], x[n_ + 1], x[n_ + 2]}; }
  void pull(In x) {
    gradient_.evaluate(model_.orbit().environment().planet.mu, x.first(nq_), position(x));
    gradient_.momentum_rates(x.first(nq_), pull_);
  }
  /// The orbit by central gravity, harmonics and the reaction; the gravity gradient on the internal
  /// motion.
  void drive(In x, Out dx) {
    const Environment& env = model_.orbit().environment();
    if (!env.third_bodies.empty() || env.atmosphere || env.solar_pressure || model_.parts().any())
      throw InvalidArgument(
          "system '" + this->description().name +
          "': third bodies, drag, sunlight, thrusters and torquers act in the split of orbit and "
          "internal motion only, not in a plain field");
    pull(x);
    for (size_t i = 0; i < nq_; ++i) dx[nq_ + i] = dx[nq_ + i] + pull_[i];
    const Vec3<T> R = position(x);
    const T d2 = dot(R, R), k = T(-env.planet.mu) / (d2 * mechanics::norm(R));
    Vec3<T> zonal;
    zonal_field(T(env.planet.mu), T(env.planet.radius), Vec3<T>(env.planet.axis), env.planet.J, R,
                zonal);
    const Vec3<T> a = k * R + zonal + T(1 / model_.orbit().mass()) * gradient_.reaction();
    for (int i = 0; i < 3; ++i) {
      dx[n_ + size_t(i)] = x[n_ + 3 + size_t(i)];
      dx[n_ + 3 + size_t(i)] = a[i];
    }
  }

  const Spacecraft& model_;
  phs::System<T>& internal_;
  GravityGradient<T> gradient_;
  size_t n_, nq_;
  std::vector<T> pull_, own_;
};

}  // namespace

Spacecraft::Spacecraft(std::shared_ptr<const mechanics::MechanicalModel> mechanical,
                       std::shared_ptr<const phs::Model> internal, Environment environment,
                       Parts parts)
    : mechanical_(std::move(mechanical)),
      internal_(std::move(internal)),
      orbit_(std::move(environment), mechanical_->mechanism().total_mass()),
      parts_(std::move(parts)),
      description_(
          describe(internal_->description(), parts_, !orbit_.environment().plates.empty())) {
  if (const auto* loops = mechanical_->constraint_set(); loops && loops->on_the_world())
    throw InvalidArgument("'" + internal_->description().name +
                          "' has a loop to the world, expected loops between links in orbit");
  const PlateForces fits(mechanical_->mechanism(), orbit_.environment().plates);
}

std::vector<double> Spacecraft::state(std::span<const double> internal,
                                      const PointState<double>& centre) const {
  require_size("internal state", internal.size(), internal_size());
  const Mechanism& m = mechanism();
  const size_t nq = size_t(m.nq());
  std::vector<double> x(internal.begin(), internal.end());
  mechanics::Workspace<double> w(m);
  const auto mechanical = std::span<double>(x).first(2 * nq);
  const auto q = mechanical.first(nq);
  const Vec3d c = mechanics::centre_of_mass<double>(m, w, q);
  Vec3d P{0, 0, 0};
  for (const auto& n : m.nodes())
    if (n.parent < 0)
      for (int k = 0; k < 3; ++k) P[k] += x[nq + size_t(n.q + k)];
  // The same rates, relative to the centre of mass.
  auto v = mechanical_->rates(mechanical);
  for (const auto& n : m.nodes()) {
    if (n.parent >= 0) continue;
    const size_t at = size_t(n.q);
    const auto xi = mechanics::Quaternion<double>::load(&x[at + base_attitude]);
    const Vec3d back = mechanics::rotation_matrix(xi).tmul((1 / m.total_mass()) * P);
    for (int k = 0; k < 3; ++k) {
      v[size_t(n.v + 3 + k)] -= back[k];
      q[at + size_t(base_position + k)] -= c[k];
    }
    const double off = mechanics::norm(Vec3d{q[at], q[at + 1], q[at + 2]});
    if (!(off <= 1e-3 * mechanics::norm(centre.r)))
      throw InvalidArgument(
          fmt::format("a body is {:.4g} km from the common centre of mass, expected a thousandth "
                      "of the {:.4g} km to the planet at most: gravity is expanded about it",
                      off / 1e3, mechanics::norm(centre.r) / 1e3));
  }
  const auto moved = mechanical_->state(q, v);
  std::copy(moved.begin(), moved.end(), mechanical.begin());
  for (size_t k = 0; k < 3; ++k) {  // zero only up to rounding so far
    double others = 0;
    for (const auto& n : m.nodes())
      if (n.parent < 0 && n.q != 0) others += x[nq + size_t(n.q) + k];
    x[nq + base_position + k] = -others;
  }
  for (const Vec3d& a : {centre.r, centre.v}) x.insert(x.end(), {a.x, a.y, a.z});
  return x;
}

template <class T>
std::unique_ptr<phs::System<T>> Spacecraft::make_system() const {
  return std::make_unique<SpacecraftSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> Spacecraft::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::space
