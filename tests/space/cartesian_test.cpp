#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/passes-inl.h"
#include "scene/assemble/assembly.h"
#include "tests/places.h"
#include "tests/space/support.h"

// The control: what the split is for. The same spacecraft in plain Cartesian coordinates, its base
// 7000 km from the planet's centre and gravity on every link, by the same method at the same step.
namespace porthos::space::cartesian_test {
namespace {

using test::breaks;
using test::keeps;

class CartesianModel : public phs::ModelFor<CartesianModel> {
 public:
  CartesianModel(const mechanics::MechanicalModel& m, double planet)
      : model(m), mu(planet), d_(m.description()) {
    d_.invariants.clear();
  }
  const phs::Description& description() const override { return d_; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;
  const mechanics::MechanicalModel& model;
  const double mu;

 private:
  phs::Description d_;
};

template <class T>
class CartesianSystem : public phs::System<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit CartesianSystem(const CartesianModel& m)
      : m_(m),
        tree_(m.model.mechanism()),
        w_(tree_),
        nq_(size_t(tree_.nq())),
        pose_(tree_.nodes().size()),
        wrench_(pose_.size()),
        zero_(nq_) {}
  const phs::Description& description() const override { return m_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<CartesianSystem>(m_);
  }
  T hamiltonian(In x) override {
    T H = mechanics::kinetic_energy<T>(tree_, w_, x.first(nq_), x.subspan(nq_));
    mechanics::forward_kinematics<T>(tree_, w_, x.first(nq_), pose_);
    for (size_t i = 0; i < pose_.size(); ++i) {
      const auto& I = tree_.nodes()[i].inertia;
      H = H - T(m_.mu * I.m) / mechanics::norm(centre(i));
    }
    return H;
  }
  void field(T, In x, In, Out dx) override {
    mechanics::forward_kinematics<T>(tree_, w_, x.first(nq_), pose_);
    for (size_t i = 0; i < pose_.size(); ++i) {
      const auto& I = tree_.nodes()[i].inertia;
      const Vec3<T> R = centre(i), c(Vec3d((1 / I.m) * I.mc));
      const T d2 = dot(R, R);
      const Vec3<T> f = pose_[i].R.tmul((T(-m_.mu * I.m) / (d2 * mechanics::norm(R))) * R);
      wrench_[i] = {cross(c, f), f};
    }
    mechanics::Loads<T> loads;
    loads.wrench = wrench_;
    mechanics::hamiltonian_field<T>(tree_, w_, x.first(nq_), x.subspan(nq_), loads, dx.first(nq_),
                                    dx.subspan(nq_));
  }
  void gradient(In x, Out e) override {
    std::vector<T> dx(2 * nq_);
    field(T(0.0), x, {}, dx);
    for (size_t i = 0; i < nq_; ++i) {
      e[i] = -dx[nq_ + i];
      e[nq_ + i] = dx[i];
    }
  }
  void rate(T, In, In e, Out dx) override { apply_structure({}, e, dx); }
  void apply_structure(In, In e, Out Je) override {
    for (size_t i = 0; i < nq_; ++i) {
      Je[i] = e[nq_ + i];
      Je[nq_ + i] = -e[i];
    }
  }
  void apply_dissipation(In, In, Out Re) override { std::fill(Re.begin(), Re.end(), T(0.0)); }
  void apply_input(In, In, Out Gu) override { std::fill(Gu.begin(), Gu.end(), T(0.0)); }
  void output(In, In, Out) override {}
  void invariants(In, Out) override {}
  void set_turn_angles(In a) override { std::copy(a.begin(), a.end(), w_.turn_angle.begin()); }

 private:
  Vec3<T> centre(size_t i) const {
    const auto& I = tree_.nodes()[i].inertia;
    return pose_[i].R * Vec3<T>(Vec3d((1 / I.m) * I.mc)) + pose_[i].r;
  }
  const CartesianModel& m_;
  const mechanics::Mechanism& tree_;
  mechanics::Workspace<T> w_;
  size_t nq_;
  std::vector<mechanics::Transform<T>> pose_;
  std::vector<mechanics::Force<T>> wrench_;
  std::vector<T> zero_;
};
template <class T>
std::unique_ptr<phs::System<T>> CartesianModel::make_system() const {
  return std::make_unique<CartesianSystem<T>>(*this);
}

TEST(Cartesian, LosesTheDigitsTheSplitKeeps) {
  const auto arm = test::ets_vii(0.3);
  Environment env;
  const auto centre = from_elements(env.planet.mu, 6928e3, 0.001, 0.6109, 0.3, 0.2, 0);
  const double h = 4;
  const int steps = 4000;
  const Spacecraft craft(arm.model, arm.model, env);
  const auto start = craft.state(arm.start.x, centre);
  const double mass = craft.orbit().mass();
  test::Gauge gauge(craft);

  // The split. Its internal energy may change by the gradient's work alone, which it books.
  phs::State split(craft.description(), start);
  SplitIntegrator by_split(craft, h);
  const long double H0 = gauge.energy(split);
  long double work = 0;
  double split_error = 0;
  for (int k = 0; k < steps; ++k) {
    ASSERT_EQ(by_split.step(split), integrators::Outcome::ok);
    work += by_split.port_work().back();
    split_error = std::max(split_error, std::fabs(double((gauge.energy(split) - H0 - work) / H0)));
  }

  // The same steps, with the state kept between them as a Cartesian code keeps it: doubles for the
  // base's inertial place and attitude and for the momenta of the motion as a whole, which goes at
  // 7.6 km/s.
  const auto& tree = craft.mechanism();
  const size_t nq = size_t(tree.nq()), n = craft.internal_size();
  phs::State plain(craft.description(), start);
  SplitIntegrator by_turns(craft, h);
  std::vector<double> stored;
  const auto store = [&] {
    std::vector<double> q(plain.x.begin(), plain.x.begin() + long(nq));
    auto v = arm.model->rates(std::span(plain.x).first(2 * nq));
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[3]));
    const Vec3d along = R.tmul({plain.x[n + 3], plain.x[n + 4], plain.x[n + 5]});
    for (int k = 0; k < 3; ++k) {
      q[size_t(k)] += plain.x[n + size_t(k)];
      v[size_t(3 + k)] += along[k];
    }
    stored = arm.model->state(q, v);
  };
  const auto recall = [&] {
    mechanics::Workspace<double> w(tree);
    const auto c =
        mechanics::centre_of_mass<double>(tree, w, std::span<const double>(stored).first(nq));
    const Vec3d P{stored[nq], stored[nq + 1], stored[nq + 2]};
    plain.x = craft.state(stored, {c, (1 / mass) * P});
    std::fill(plain.lo.begin(), plain.lo.end(), 0.0);
  };
  store();
  recall();
  const long double H1 = gauge.energy(plain);
  long double given = 0;
  double plain_error = 0;
  for (int k = 0; k < steps; ++k) {
    ASSERT_EQ(by_turns.step(plain), integrators::Outcome::ok);
    given += by_turns.port_work().back();
    store();
    recall();
    plain_error = std::max(plain_error, std::fabs(double((gauge.energy(plain) - H1 - given) / H1)));
  }
  std::printf("  internal energy %.4e J; one rounding of the orbital energy %.1e J\n", double(H0),
              double(mass) * 5.7e7 / 2 * 2.2e-16);
  keeps("split: internal ledger's defect, relative, 4.4 h", split_error, 1e-13);
  breaks("Cartesian state between the steps", plain_error, 1e-10);
  std::printf("  digits lost: %.1f\n", std::log10(plain_error / split_error));

  // And gauss16 on the Cartesian field does not converge at this step at all: a stage whose
  // attitude is off by 1e-3 rad belongs to a body whose momentum, 2e7 kg m/s beside its centre,
  // turns it at 1 rad/s.
  store();
  const CartesianModel cartesian(*arm.model, env.planet.mu);
  phs::State state(cartesian.description(), stored);
  const auto by_gauss = integrators::make_integrator("gauss16", cartesian, h);
  EXPECT_NE(by_gauss->step(state), integrators::Outcome::ok);
  const auto tiny = integrators::make_integrator("gauss16", cartesian, 1e-4);
  EXPECT_EQ(tiny->step(state), integrators::Outcome::ok);
}

TEST(Cartesian, LosesThemInTheSceneOfTheYear) {
  // examples/ets_vii_orbit itself, drives, dampers and all, at its own step: 5.6 hours of it.
  const auto scene =
      scene::read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/ets_vii_orbit/scene.toml");
  const auto a = scene::assemble(scene);
  const Spacecraft& craft = *a.spacecraft;
  const auto& tree = craft.mechanism();
  const size_t nq = size_t(tree.nq()), n = craft.internal_size();
  ASSERT_EQ(n, 2 * nq);
  const double mass = craft.orbit().mass();
  const auto& powers = craft.description().powers;
  test::Gauge gauge(craft);
  // What a Cartesian code keeps from step to step: inertial place and velocity of the base, in
  // doubles.
  const auto through_cartesian = [&](phs::State& s) {
    std::vector<double> q(s.x.begin(), s.x.begin() + long(nq));
    auto v = a.mechanical->rates(std::span(s.x).first(2 * nq));
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[3]));
    const Vec3d along = R.tmul({s.x[n + 3], s.x[n + 4], s.x[n + 5]});
    for (int k = 0; k < 3; ++k) {
      q[size_t(k)] += s.x[n + size_t(k)];
      v[size_t(3 + k)] += along[k];
    }
    const auto stored = a.mechanical->state(q, v);
    mechanics::Workspace<double> w(tree);
    const auto c =
        mechanics::centre_of_mass<double>(tree, w, std::span<const double>(stored).first(nq));
    s.x = craft.state(stored, {c, (1 / mass) * Vec3d{stored[nq], stored[nq + 1], stored[nq + 2]}});
    std::fill(s.lo.begin(), s.lo.end(), 0.0);
  };
  const auto defect = [&](bool cartesian) {
    SplitIntegrator by(craft, scene.step,
                       {.splitting = scene.orbit->splitting, .method = scene.method});
    phs::State s = a.initial;
    if (cartesian) through_cartesian(s);
    const long double H0 = gauge.energy(s);
    long double given = 0, worst = 0;
    for (int k = 0; k < 4000; ++k) {
      EXPECT_EQ(by.step(s), integrators::Outcome::ok);
      for (size_t i = 0; i < powers.size(); ++i)
        given += (powers[i].kind == phs::PowerKind::supplied ? 1 : -1) * by.port_work()[i];
      if (cartesian) through_cartesian(s);
      worst = std::max(worst, std::fabs(gauge.energy(s) - H0 - given));
    }
    return double(worst / std::fabs(H0));
  };
  const double split = defect(false), plain = defect(true);
  keeps("the scene of the year: internal defect / H", split, 1e-11);
  breaks("with a Cartesian state between the steps", plain, 1e-9);
  std::printf("  digits lost: %.1f\n", std::log10(plain / split));
}

}  // namespace
}  // namespace porthos::space::cartesian_test
