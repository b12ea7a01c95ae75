#include <random>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "phs/system/random_state.h"
#include "tests/space/support.h"

// Drag and sunlight on flat plates: closed forms, virtual work, and the ledger.
namespace porthos::space::plates_test {
namespace {

using test::breaks;
using test::keeps;

constexpr double pi = 3.14159265358979323846;

Plate plate(const std::string& link, double area, const Vec3d& normal, const Vec3d& place) {
  Plate p;
  p.link = link;
  p.area = area;
  p.normal = normal;
  p.place = place;
  return p;
}

TEST(Plates, ASphereOfThemFeelsWhatASphereFeels) {
  const auto body = test::rigid_body(100, {10, 12, 14});
  std::vector<Plate> sphere;
  const double R = 1.5;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {  // Fibonacci's points
    const double z = 1 - (2 * i + 1.0) / n, turn = pi * (3 - std::sqrt(5.0)) * i,
                 r = std::sqrt(1 - z * z);
    const Vec3d normal{r * std::cos(turn), r * std::sin(turn), z};
    sphere.push_back(plate("body", 4 * pi * R * R / n, normal, R * normal));
  }
  const double xi[] = {0.5, 0.5, -0.5, 0.5};
  const auto x = test::body_state(*body, xi, {0, 0, 0});
  const Vec3d through{6e3, -2e3, 3e3}, s = (1 / 7.0) * Vec3d{2, 3, 6};
  const double speed = mechanics::norm(through), density = 1e-12, P = 4.56e-6;
  struct Light {
    const char* what;
    double specular, diffuse, factor;
  };
  // Wertz 1978, table 17-2 and its neighbours: absorbed and mirrored alike 1, scattered 1 + 4/9.
  for (const Light& l : {Light{"absorbing", 0, 0, 1},
                         {"mirroring", 1, 0, 1},
                         {"scattering", 0, 1, 1 + 4.0 / 9},
                         {"half each", 0.5, 0.5, 1 + 2.0 / 9}}) {
    for (auto& p : sphere) {
      p.drag = 2.2;
      p.specular = l.specular;
      p.diffuse = l.diffuse;
    }
    PlateForces f(body->mechanism(), sphere);
    f.place(std::span(x).first(7));
    const Vec3d drag = f.drag(through, density), light = f.light(s, P);
    const Vec3d exact_drag = (-0.5 * density * 2.2 * pi * R * R * speed) * through,
                exact_light = (-P * pi * R * R * l.factor) * s;
    keeps(std::string(l.what) + ": sunlight on a sphere",
          mechanics::norm(light - exact_light) / mechanics::norm(exact_light), 1e-4);
    keeps("drag on it", mechanics::norm(drag - exact_drag) / mechanics::norm(exact_drag), 1e-4);
    f.project();
    keeps("torque about its centre, over force times radius",
          mechanics::norm(f.torque()) / (R * mechanics::norm(drag + light)), 1e-4);
  }
}

TEST(Plates, TurnAWeathervaneIntoTheStream) {
  // One plate at the end of a boom: torque = boom × force, restoring behind the centre of mass.
  const auto body = test::rigid_body(100, {10, 12, 14});
  Plate p = plate("body", 2, {1, 0, 0}, {-3, 0, 0});
  p.drag = 2;
  PlateForces f(body->mechanism(), {p});
  for (const double tilt : {-0.5, 0.2, 1.1}) {
    const double xi[] = {std::cos(tilt / 2), 0, 0, std::sin(tilt / 2)};
    const auto x = test::body_state(*body, xi, {0, 0, 0});
    f.place(std::span(x).first(7));
    const double q = 0.5 * 1e-10 * 7500 * 7500 * 2 * 2;
    f.drag({7500, 0, 0}, 1e-10);
    f.project();
    keeps("torque on the vane",
          std::fabs(f.torque().z / (-3 * q * std::cos(tilt) * std::sin(tilt)) - 1), 1e-14);
  }
  const double away[] = {0, 0, 0, 1};
  const auto x = test::body_state(*body, away, {0, 0, 0});
  f.place(std::span(x).first(7));
  EXPECT_EQ(mechanics::norm(f.drag({7500, 0, 0}, 1e-10)), 0);  // seen from behind: no plate there
}

TEST(Plates, GiveJointsTheirVirtualWork) {
  const auto arm = test::small_arm();
  const auto& m = arm->mechanism();
  std::mt19937_64 rng(5);
  auto x = phs::random_state(arm->description(), 0.7, rng);
  const size_t nq = size_t(m.nq());
  std::vector<Plate> plates{plate("upper", 2, {1, 0.3, -2}, {0.3, 1, -1}),
                            plate("lower", 1, {-0.2, 1, 0.4}, {1, 0.5, 0.2}),
                            plate("slide", 3, {0.1, 0.2, 1}, {0, -0.7, 0.4})};
  for (auto& p : plates) {
    p.drag = 2.3;
    p.specular = 0.4;
    p.diffuse = 0.3;
  }
  PlateForces f(m, plates);
  const auto q = std::span<const double>(x).first(nq);
  f.place(q);
  const Vec3d through{3e3, 5e3, -4e3}, s{0.6, 0, 0.8};
  const Vec3d whole = f.drag(through, 1e-11) + f.light(s, 4.56e-6);
  f.project();
  // Their power at any rates: Σ F·(velocity of the plate - velocity of the centre of mass).
  const auto v = arm->rates(std::span<const double>(x).first(2 * nq));
  double power = 0;
  for (size_t j = 0; j < v.size(); ++j) power += f.joint_forces()[j] * v[j];
  const double dt = 1e-6;
  mechanics::Workspace<double> w(m);
  std::vector<double> q_dot(nq), p_dot(nq);
  mechanics::hamiltonian_field<double>(m, w, q, std::span<const double>(x).subspan(nq, nq), {},
                                       q_dot, p_dot);
  const auto at = [&](double t, size_t k) {
    std::vector<double> moved(nq);
    for (size_t i = 0; i < nq; ++i) moved[i] = q[i] + t * q_dot[i];
    std::vector<mechanics::Transform<double>> pose(m.nodes().size());
    mechanics::forward_kinematics<double>(m, w, moved, pose);
    const auto& T = pose[size_t(m.body(plates[k].link).node)];
    const auto& frame = m.body(plates[k].link).pose;
    return T.R * (frame.R * plates[k].place + frame.r) + T.r -
           mechanics::centre_of_mass<double>(m, w, moved);
  };
  double expected = 0;
  Vec3d again{0, 0, 0};
  for (size_t k = 0; k < plates.size(); ++k) {
    PlateForces one(m, {plates[k]});
    one.place(q);
    const Vec3d F = one.drag(through, 1e-11) + one.light(s, 4.56e-6);
    again += F;
    expected += dot(F, (1 / (2 * dt)) * (at(dt, k) - at(-dt, k)));
  }
  EXPECT_GT(mechanics::norm(whole), 0);
  keeps("sum of the forces", mechanics::norm(whole - again) / mechanics::norm(whole), 1e-14);
  keeps("power on base and joints", std::fabs(power / expected - 1), 1e-7);
}

TEST(Plates, StandInTheLedgers) {
  const auto arm = test::ets_vii(0.1);
  Environment env;
  env.planet.rotation_rate = 7.292e-5;
  env.third_bodies = {mean_sun(0.5)};
  env.atmosphere = Atmosphere{1e-11, 500e3, 60e3, 0};
  env.solar_pressure = SolarPressure{};
  const auto& bodies = arm.model->mechanism().bodies();
  for (const auto& p : {plate(bodies[0].name, 20, {0.3, 0.1, 1}, {2, 3, 0}),
                        plate(bodies[0].name, 20, {-0.3, -0.1, -1}, {2, 3, 0}),
                        plate(bodies[3].name, 1, {0, 1, 0}, {0.5, 0, 0})}) {
    env.plates.push_back(p);
    env.plates.back().drag = 2.2;
    env.plates.back().specular = 0.3;
    env.plates.back().diffuse = 0.2;
  }
  const auto fly = [&](const Environment& e, SpaceReport& r, double& worst, double& given) {
    const Spacecraft craft(arm.model, arm.model, e);
    phs::State s(craft.description(),
                 craft.state(arm.start.x, from_elements(e.planet.mu, 6878e3, 0.001, 0.6, 0, 0, 0)));
    SplitIntegrator by(craft, 8);
    test::Gauge gauge(craft);
    const long double H0 = gauge.energy(s);
    long double work = 0, most = std::fabs(H0);  // of the energy so far: they spin it up
    worst = given = 0;
    for (int k = 0; k < 1500; ++k) {
      ASSERT_EQ(by.step(s), integrators::Outcome::ok);
      for (const double w : by.port_work()) work += w;
      if (!e.plates.empty()) given += by.port_work().back();
      most = std::max(most, std::fabs(gauge.energy(s)));
      worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0 - work) / most)));
    }
    r = by.ledgers().report();
  };
  SpaceReport r, without;
  double worst, given, none;
  fly(env, r, worst, given);
  keeps("internal ledger with plates", worst, 1e-12);
  keeps("orbital ledger", r.orbital.relative(), 1e-16);
  keeps("angular momentum less impulses", r.angular_defect, 1e-13);
  EXPECT_NEAR(r.plates_work, given, 1e-13);
  breaks("work of the plates on the internal motion [J]", std::fabs(given), 1e-7);
  env.plates.clear();
  env.atmosphere->area_coefficient = env.solar_pressure->area_coefficient = 1;
  fly(env, without, worst, none);
  breaks("angular momentum that a sphere would not give",
         std::fabs(r.angular_momentum - without.angular_momentum) / r.angular_momentum, 1e-3);
}

TEST(Plates, AreRefusedInOneSentence) {
  Environment env;
  env.planet.rotation_rate = 0;
  env.atmosphere = Atmosphere{1e-11, 500e3, 60e3, 0};
  const auto says = [&](Plate p) {
    env.plates = {p};
    return test::refusal([&] { env.validate(); });
  };
  EXPECT_EQ(says(plate("a", 1, {0, 0, 1}, {})), "");
  EXPECT_EQ(says(plate("a", 0, {0, 0, 1}, {})),
            "a plate of link 'a' has area 0 m^2, expected a positive number");
  EXPECT_NE(says(plate("a", 1, {0, 0, 0}, {})).find("normal of length 0"), std::string::npos);
  Plate p = plate("a", 1, {0, 0, 1}, {});
  p.specular = 0.7;
  p.diffuse = 0.5;
  EXPECT_NE(says(p).find("together at most 1"), std::string::npos);
  env.atmosphere.reset();
  EXPECT_NE(says(plate("a", 1, {0, 0, 1}, {})).find("expected drag or sunlight"),
            std::string::npos);
  const auto body = test::rigid_body(100, {10, 12, 14});
  EXPECT_NE(test::refusal([&] {
              PlateForces(body->mechanism(), {plate("panel", 1, {0, 0, 1}, {})});
            }).find("panel"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::space::plates_test
