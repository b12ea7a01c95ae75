// Parameters from logs: slopes against the adjoint, springs and friction from a file, combinations
// that a log does not tell, what is written, and what is refused.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "scene/files/files.h"
#include "scene/identification/detail/output_error.h"
#include "scene/sensitivity/ridders.h"
#include "scene/sensitivity/sensitivity.h"
#include "tests/identification/support.h"
#include "tests/places.h"
#include "tests/support/bounds.h"

namespace porthos::scene::identification_test {
namespace {

constexpr const char* swing_urdf = R"(<robot name="swing"><link name="ground"/>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="0.2" iyy="0.21" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/></joint>
</robot>)";

/// A rod that hangs in gravity, on a spring with friction.
std::string swing(double stiffness, double coulomb, double viscous, double step = 0.1) {
  return fmt::format(R"([model]
urdf = "swing.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.hinge = {{ position = 1.2, velocity = 0.3 }}
[[element]]
type = "spring"
name = "coil"
joint = "hinge"
stiffness = {:.17g}
[[element]]
type = "friction"
name = "bearing"
joint = "hinge"
coulomb = {:.17g}
viscous = {:.17g}
smoothing = 0.2
[integrator]
method = "gauss16"
step = {}
[run]
duration = 1
)",
                     stiffness, coulomb, viscous, step);
}

class IdentificationOfScenes : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    write("swing.urdf", swing_urdf);
  }
  std::string refused(const Scene& s, const NamedColumns& log, std::vector<std::string> parameters,
                      LogNoise noise = {}) const {
    return refusal(
        [&] { identify(s, log, {.parameters = std::move(parameters), .noise = noise}); });
  }
};

// --- slopes --------------------------------------------------------------------------------------

/// The tangents against the discrete adjoint of the same run, which knows ∂f/∂θ in closed form.
TEST(Identification, SlopesAreThoseOfTheAdjoint) {
  Scene s = read_scene(PORTHOS_SOURCE_DIR "/examples/ets_vii/scene.toml");
  s.duration = 20;
  s.centre_stays = true;
  const std::vector<std::string> names{"joint_3.velocity", "joint_6.position",
                                       "base.angular_velocity.z", "base.linear_velocity.x"};
  const std::vector<std::string> parameters{"link_6.mass", "link_6.com.z", "link_6.inertia.xx",
                                            "link_3.inertia.xy", "joint_2.velocity"};
  const auto exact = end_sensitivity(s, {.of = names});
  ASSERT_EQ(exact.failure, "");
  const Assembly a = assemble(s);
  const Unknowns unknowns(s, a, parameters);
  Log log{.path = "log", .times = {10, 20}, .columns = {}, .unused = {}};
  for (const auto& name : names) log.columns.push_back({Observed{name, "", false}, 0, {0, 0}});
  OutputError error(s, unknowns, log, nullptr);
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  ASSERT_TRUE(error.at(unknowns.start(), r, &J)) << error.why();
  double worst = 0, control = 0;
  for (size_t i = 0; i < names.size(); ++i) {
    double size = 0;
    std::vector<double> off, early;
    for (size_t k = 0; k < parameters.size(); ++k) {
      const auto at = std::ranges::find(exact.inputs, parameters[k], &Input::name);
      ASSERT_NE(at, exact.inputs.end()) << parameters[k];
      const auto& u = unknowns.list()[k];
      const bool logarithm = parameters[k].ends_with("mass") || parameters[k].ends_with("xx");
      const double by_z =
          exact.of[i].slopes[size_t(at - exact.inputs.begin())] * (logarithm ? u.start : u.scale);
      size = std::max(size, std::fabs(by_z));
      off.push_back(J(Eigen::Index(names.size() + i), Eigen::Index(k)) - by_z);
      early.push_back(J(Eigen::Index(i), Eigen::Index(k)) - by_z);
    }
    for (const double x : off) worst = std::max(worst, std::fabs(x) / size);
    for (const double x : early) control = std::max(control, std::fabs(x) / size);
  }
  // Differences of the field over 6e-6 of a whole change are known to some 1e-10 of it; of what is
  // observed likewise, times the condition of the mass matrix.
  std::printf("  slopes off by %.1e   bound 1e-7; at half the time %.1e\n", worst, control);
  EXPECT_LT(worst, 1e-7);
  EXPECT_GT(control, 1e-2);
}

/// Between steps too, and of an output: against differences of whole runs by Ridders' method.
TEST_F(IdentificationOfScenes, SlopesBetweenSteps) {
  Scene s = read(swing(6, 0.4, 0.05) + R"([[output]]
name = "tip"
quantity = "position"
link = "rod"
at = [0, 0, -1]
)");
  s.centre_stays = true;
  const Assembly a = assemble(s);
  const Unknowns unknowns(s, a, {"coil.stiffness", "bearing.coulomb", "rod", "hinge.velocity"});
  Log log{.path = "log", .times = {0, 0.033, 0.7, 1.234}, .columns = {}, .unused = {}};
  for (const char* name : {"tip.x", "tip.z", "hinge.velocity", "hinge.position"})
    log.columns.push_back({Observed{name, "", false}, 0, {0, 0, 0, 0}});
  OutputError error(s, unknowns, log, nullptr);
  Eigen::VectorXd r, moved;
  Eigen::MatrixXd J;
  ASSERT_TRUE(error.at(unknowns.start(), r, &J)) << error.why();
  double worst = 0, unknown = 0, control = 0;
  for (size_t k = 0; k < unknowns.size(); ++k) {
    const auto f = [&](double d) {
      auto z = unknowns.start();
      z[k] += d;
      EXPECT_TRUE(error.at(z, moved, nullptr)) << error.why();
      return std::span<const double>(moved.data(), size_t(moved.size()));
    };
    const auto known = ridders(f, size_t(r.size()), 0.05);
    for (size_t i = 0; i < known.slope.size(); ++i) {
      const double mine = J(Eigen::Index(i), Eigen::Index(k));
      worst = std::max(worst, std::fabs(mine - known.slope[i]));
      unknown = std::max(unknown, known.error[i]);
      // of the next time in place of this one
      if (i >= 4) control = std::max(control, std::fabs(mine - known.slope[i - 4]));
    }
  }
  // The tangents are of the same runs; what is left is the difference of fields, some 1e-10 of a
  // slope of order one, and the error of the reference.
  std::printf("  slopes off by %.1e   bound 1e-8 (the reference's own error %.1e)\n", worst,
              unknown);
  EXPECT_LT(worst, 1e-8);
  EXPECT_GT(control, 1e-2);
}

// --- springs and friction ------------------------------------------------------------------------

TEST_F(IdentificationOfScenes, SpringAndFrictionFromAFile) {
  const Scene truth = read(swing(6, 0.4, 0.05, 0.01));
  const double sigma = 2e-3;
  // Times between the steps of the fit; the angle wraps as an encoder's.
  const auto log =
      noisy(run_of(truth, {"hinge.position", "hinge.velocity"}, 8, 3), {.of_all = sigma}, 7);
  std::string csv = "# recorded\ntime,hinge.position,temperature,hinge.velocity\n";
  for (size_t i = 0; i < log.at("time").size(); ++i)
    csv += fmt::format("{},{},20,{}\n", log.at("time")[i],
                       log.at("hinge.position")[i] + (i % 2 ? 2 * std::numbers::pi : 0),
                       log.at("hinge.velocity")[i]);
  const std::string path = write("log.csv", csv);
  const Scene start = read(swing(3, 1, 0.2));
  const auto r = identify(start, path,
                          {.parameters = {"coil.stiffness", "bearing.coulomb", "bearing.viscous"},
                           .noise = {.of_all = sigma}});
  ASSERT_EQ(r.failure, "");
  EXPECT_TRUE(r.converged);
  std::printf("%s", clean(identification_text(r)).c_str());
  const double expected[] = {6, 0.4, 0.05};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_LT(std::fabs(r.found[i].value - expected[i]), 4 * r.found[i].deviation);
    EXPECT_LT(r.found[i].deviation, 0.1 * expected[i]);
  }
  EXPECT_EQ(r.found[0].of.unit, "N m/rad");
  EXPECT_LT(std::fabs(r.surprise()), 4);
  ASSERT_EQ(r.notes.size(), 1u);
  EXPECT_EQ(r.notes[0], "columns of the log that are not used: temperature");
  // Control: a model without the friction disagrees with the log, and says so.
  const auto wrong = identify(read(swing(3, 1e-6, 0)), path,
                              {.parameters = {"coil.stiffness"}, .noise = {.of_all = sigma}});
  EXPECT_GT(wrong.surprise(), 100);
  EXPECT_NE(identification_text(wrong).find("the model lacks something"), std::string::npos);
}

TEST_F(IdentificationOfScenes, NoiseFromTheResidual) {
  const Scene truth = read(swing(6, 0.4, 0.05));
  const auto log = noisy(run_of(truth, {"hinge.velocity"}, 40), {.of_all = 1e-3}, 3);
  const auto r = identify(read(swing(4, 0.4, 0.05)), log, {.parameters = {"coil.stiffness"}});
  EXPECT_TRUE(r.converged);
  // 400 numbers: the estimate is known to 1/√800.
  EXPECT_NEAR(r.noise, 1e-3, 4 * 1e-3 / std::sqrt(800));
  EXPECT_LT(std::fabs(r.found[0].value - 6), 4 * r.found[0].deviation);
}

/// Noise that goes on from row to row moves values by more than their sigmas say. Control: white.
TEST_F(IdentificationOfScenes, NoiseThatGoesOnOverRowsIsNoted) {
  const auto clean = run_of(read(swing(6, 0.4, 0.05)), {"hinge.velocity"}, 40);
  const auto notes_of = [&](double correlation) {
    auto log = clean;
    std::mt19937_64 random(7);
    std::normal_distribution<> fresh(0, 1e-3 * std::sqrt(1 - correlation * correlation));
    double noise = 0;
    for (double& v : log["hinge.velocity"]) v += noise = correlation * noise + fresh(random);
    const auto r = identify(read(swing(4, 0.4, 0.05)), log,
                            {.parameters = {"coil.stiffness"}, .noise = {.of_all = 1e-3}});
    std::string notes;
    for (const auto& note : r.notes) notes += note + "\n";
    return notes;
  };
  EXPECT_NE(notes_of(0.8).find("goes on from row to row, with a correlation of 0."),
            std::string::npos);
  EXPECT_EQ(notes_of(0).find("goes on from row to row"), std::string::npos);
}

TEST_F(IdentificationOfScenes, OfItsOwnLogIsExact) {
  const auto log = run_of(read(swing(6, 0.4, 0.05)), {"hinge.position"}, 10);
  const auto r = identify(read(swing(3, 0.8, 0.02)), log,
                          {.parameters = {"coil.stiffness", "bearing.coulomb", "bearing.viscous"}});
  EXPECT_TRUE(r.converged);
  EXPECT_NEAR(r.found[0].value, 6, 1e-10);
  EXPECT_NEAR(r.found[1].value, 0.4, 1e-10);
  EXPECT_NEAR(r.found[2].value, 0.05, 1e-10);
}

/// A spring of one's own behind a fixed motor; its rest follows the joint's start, or is stated.
TEST_F(IdentificationOfScenes, AFormulaBehindAFixedMotor) {
  const auto with_formula = [&](double k, double a, const char* rest) {
    return read(swing(6, 0.4, 0.05) +
                fmt::format("[[actuator]]\nname = \"vsa\"\njoint = \"hinge\"\nfamily = "
                            "\"formula\"\nenergy = \"0.5*k*phi^2 + a*phi^4\"\nparameters = {{ k "
                            "= {}, a = {} }}\ntheta = {{ drive = \"fixed\"{} }}\n",
                            k, a, rest));
  };
  for (const char* rest : {"", ", start = 0.2"}) {
    const auto log = run_of(with_formula(5, 3, rest), {"hinge.position", "hinge.velocity"}, 5);
    const auto r = identify(
        with_formula(4, 2, rest), log,
        {.parameters = {"vsa.parameters.k", "vsa.parameters.a", "hinge.position", "rod.mass"},
         .noise = {.of_all = 1e-3}});
    EXPECT_TRUE(r.converged);
    test::keeps("k of a formula", std::fabs(r.found[0].value - 5), 1e-7);
    test::keeps("a of a formula", std::fabs(r.found[1].value - 3), 1e-7);
    test::keeps("start", std::fabs(r.found[2].value - 1.2), 1e-8);
    test::keeps("mass", std::fabs(r.found[3].value - 2), 1e-8);
  }
}

/// The starts of a run are numbers like others.
TEST_F(IdentificationOfScenes, StartValues) {
  const auto log = run_of(read(swing(6, 0.4, 0.05)), {"hinge.position"}, 5);
  Scene s = read(swing(6, 0.4, 0.05));
  std::string text = s.text;
  text.replace(text.find("velocity = 0.3"), 14, "velocity = 0.1");
  const auto r = identify(read(text), log, {.parameters = {"hinge.velocity"}});
  EXPECT_NEAR(r.found[0].value, 0.3, 1e-11);
  EXPECT_EQ(r.found[0].of.unit, "rad/s");
}

TEST_F(IdentificationOfScenes, NumbersOfTheSceneByTheirKeys) {
  const auto log = run_of(read(swing(6, 0.4, 0.05)), {"hinge.position"}, 5);
  std::string text = swing(6, 0.4, 0.05);
  text.replace(text.find("-9.81"), 5, "-1.62");
  const auto r =
      identify(read(text), log, {.parameters = {"environment.vector[2]", "element[0].stiffness"}});
  EXPECT_NEAR(r.found[0].value, -9.81, 1e-9);
  EXPECT_EQ(r.found[0].of.unit, "m/s²");
  EXPECT_NEAR(r.found[1].value, 6, 1e-9);
  EXPECT_EQ(r.found[1].of.unit, "N m/rad");
}

// --- what a log does not tell --------------------------------------------------------------------

/// Of a rod in gravity, rates tell m l / (I + m l²) alone: two combinations of three are not told.
TEST_F(IdentificationOfScenes, CombinationsThatAreNotTold) {
  const Scene s = read(swing(0, 1e-9, 0));
  const auto r = identify(
      s, run_of(s, {"hinge.velocity"}, 10),
      {.parameters = {"rod.mass", "rod.com.z", "rod.inertia.yy"}, .noise = {.of_all = 1e-3}});
  ASSERT_EQ(r.combinations.size(), 3u);
  EXPECT_TRUE(r.combinations[0].told);
  for (size_t i = 1; i < 3; ++i) {
    EXPECT_FALSE(r.combinations[i].told);
    // Along them nothing of m c / (I + m c²) changes: dm (1/m - c²/J) + dc (1/c - 2 m c/J) - dI/J,
    // with J = I + m c².
    const auto& c = r.combinations[i];
    const double m = 2, l = -0.5, I = 0.21, J = I + m * l * l;
    const double change = c.moves[0] * r.found[0].of.scale * (1 / m - l * l / J) +
                          c.moves[1] * r.found[1].of.scale * (1 / l - 2 * m * l / J) -
                          c.moves[2] * r.found[2].of.scale / J;
    std::printf("  combination %zu changes m l/J by %.1e of itself   bound 1e-6\n", i, change);
    EXPECT_LT(std::fabs(change), 1e-6);
  }
  for (const Found& f : r.found) EXPECT_TRUE(std::isnan(f.deviation)) << f.of.name;
  EXPECT_NE(identification_text(r).find("untold      no effect: rod."), std::string::npos);
  // Control: one of them alone is told.
  const auto one = identify(s, run_of(s, {"hinge.velocity"}, 10),
                            {.parameters = {"rod.inertia.yy"}, .noise = {.of_all = 1e-3}});
  EXPECT_TRUE(one.combinations[0].told);
}

/// A rod that its other moments do not allow: the fit ends at the triangle inequality.
TEST_F(IdentificationOfScenes, EndsAtTheEdge) {
  const Scene s = read(swing(6, 0.4, 0.05));
  Scene other = s;
  other.urdf.link_inertia["rod"] = {2, {0, 0, -0.5}, {0.3, 0, 0, 0.3, 0, 0.02}};
  other.urdf.replaced_inertia.insert("rod");
  const auto r = identify(s, run_of(other, {"hinge.velocity"}, 5),
                          {.parameters = {"rod.inertia.yy"}, .noise = {.of_all = 1e-3}});
  EXPECT_FALSE(r.converged);
  EXPECT_NEAR(r.found[0].value, 0.22, 1e-5);
  ASSERT_FALSE(r.notes.empty());
  EXPECT_NE(r.notes[0].find("inertia breaks the triangle inequality"), std::string::npos)
      << r.notes[0];
}

// --- what is written -----------------------------------------------------------------------------

TEST_F(IdentificationOfScenes, TheSceneWithTheValuesFound) {
  const auto log = run_of(read(swing(6, 0.4, 0.05)), {"hinge.position"}, 10);
  const Scene start = read(swing(3, 0.4, 0.05));
  const auto r = identify(start, log, {.parameters = {"coil.stiffness", "rod.mass"}});
  const auto out = folder_ / "results" / "found";
  write_identification(out.string(), start, r);
  const Scene found = read_scene((out / "found.toml").string());
  EXPECT_EQ(fs::weakly_canonical(found.urdf_path), fs::weakly_canonical(folder_ / "swing.urdf"));
  const auto& rod = found.urdf.link_inertia.at("rod");
  EXPECT_EQ(rod.mass, r.found[1].value);
  EXPECT_NEAR(rod.mass, 2, 1e-9);
  EXPECT_NEAR(rod.inertia.yy, 0.21, 1e-15);
  const auto again = run_of(found, {"hinge.position"}, 10).at("hinge.position");
  EXPECT_NEAR(again.back(), log.at("hinge.position").back(), 1e-9);
  for (const char* file : {"identify.json", "identify.txt", "identify.svg"})
    EXPECT_GT(fs::file_size(out / file), 100u) << file;
}

/// A factor on the mass is in the number found, and gone.
TEST_F(IdentificationOfScenes, AFactorOnTheMassIsTakenIn) {
  const auto log = run_of(read(swing(6, 0.4, 0.05)), {"hinge.position"}, 10);
  std::string text = swing(6, 0.4, 0.05);
  text.insert(text.find("[environment]"), "mass_factor.rod = 0.8\n");
  const Scene start = read(text);
  const auto r = identify(start, log, {.parameters = {"rod"}});
  EXPECT_NEAR(r.found[0].of.start, 1.6, 1e-15);
  write_identification((folder_ / "found").string(), start, r);
  const Scene found = read_scene((folder_ / "found" / "found.toml").string());
  EXPECT_EQ(found.urdf.link_inertia.at("rod").mass, r.found[0].value);
  EXPECT_TRUE(found.mass_factor.empty());
  const auto again = run_of(found, {"hinge.position"}, 10).at("hinge.position");
  EXPECT_NEAR(again.back(), log.at("hinge.position").back(), 1e-6);
}

/// Where a line breaks is undefined behaviour in toml++ 3.3 for a number below 0.1.
TEST_F(IdentificationOfScenes, ASmallNumberBreaksNoLine) {
  std::string text = swing(6, 0.4, 0.05);
  text.replace(text.find("vector = [0,"), 12, "vector = [1e-20,");
  const Scene start = read(text);
  const auto r = identify(start, run_of(start, {"hinge.position"}, 10), {.parameters = {"rod"}});
  write_identification((folder_ / "found").string(), start, r);
  const std::string found = read_scene((folder_ / "found" / "found.toml").string()).text;
  EXPECT_NE(found.find("vector = [ 9.9999999999999995e-21, 0, -9.8"), std::string::npos) << found;
}

// --- what is refused -----------------------------------------------------------------------------

TEST_F(IdentificationOfScenes, Refusals) {
  const Scene s = read(swing(6, 0.4, 0.05));
  const NamedColumns log = run_of(s, {"hinge.position", "hinge.velocity"}, 1);
  NamedColumns rates = log;
  rates.erase("hinge.position");
  EXPECT_EQ(refused(s, rates, {}).substr(0, 35), "scene.toml: no parameters are named");
  EXPECT_EQ(refused(s, rates, {"spring.stiffness"}),
            "scene.toml: there is no parameter 'spring.stiffness', expected a body or its number "
            "(\"link_6\", \"link_6.mass\"), a number of an element by its name "
            "(\"spring.stiffness\"), a start value (\"joint_1.velocity\") or a key of initial, "
            "environment, model, element, body, contact, actuator; the elements are coil, bearing");
  EXPECT_EQ(refused(s, rates, {"coil.cubic"}),
            "scene.toml: the parameter 'coil.cubic' is no number of the scene, expected one that "
            "it states, to start from");
  EXPECT_EQ(refused(s, rates, {"hinge.damping"}),
            "scene.toml: the parameter 'hinge.damping' of the model file cannot be found, expected "
            "an [[element]] of the scene at the joint instead, \"<its name>.damping\"");
  EXPECT_EQ(refused(s, rates, {"rod.mass", "rod"}),
            "scene.toml: the parameter 'rod.mass' is asked for twice, expected it once");
  EXPECT_EQ(refused(read(swing(0, 0.4, 0.05)), rates, {"coil.stiffness"}),
            "scene.toml: the parameter 'coil.stiffness' starts at 0, expected more than 0: it is "
            "found by its logarithm");
  EXPECT_EQ(refused(s, log, {"coil.stiffness"}),
            "the log: 'hinge.position' is in rad and 'hinge.velocity' in rad/s, expected the noise "
            "of each by sigma, which weighs them");
  EXPECT_EQ(refused(s, log, {"coil.stiffness"}, {.by_name = {{"hinge.position", 0.1}}}),
            "sigma of 'hinge.velocity' is not given and that of others is, expected it of all "
            "columns");
  EXPECT_EQ(refused(s, rates, {"coil.stiffness"}, {.of_all = -1}),
            "sigma is -1, expected a positive number, the standard deviation of the noise in the "
            "unit of the column");
  EXPECT_EQ(refused(s, rates, {"coil.stiffness"}, {.by_name = {{"hing.velocity", 1}}}),
            "sigma is given of 'hing.velocity', which is no column that is used, expected one of "
            "hinge.velocity");
  NamedColumns backwards = rates;
  backwards["time"][3] = 0;
  EXPECT_EQ(refused(s, backwards, {"coil.stiffness"}),
            "the log, row 3: time is 0 s after 0.2 s, expected times that increase");
  NamedColumns other{{"time", {0, 1}}, {"elbow.position", {0, 0}}};
  EXPECT_EQ(refused(s, other, {"coil.stiffness"}),
            "the log has 'elbow.position', which a run has not, expected some of hinge.position, "
            "hinge.velocity");
  EXPECT_EQ(refused(s, {{"time", {0, 1}}, {"hinge.velocity", {0, 0}}},
                    {"coil.stiffness", "bearing.coulomb"}),
            "the log: it has 2 numbers for 2 parameters, expected more");
  Scene other_method = s;
  other_method.method = "rk4";
  EXPECT_EQ(refused(other_method, rates, {"coil.stiffness"}),
            "derivatives of a run are there for Gauss collocation (gauss2 to gauss16, midpoint), "
            "not for 'rk4'");
  Scene controlled = s;
  controlled.step_control = integrators::StepControl::reversible;
  EXPECT_EQ(refused(controlled, rates, {"coil.stiffness"}),
            "scene.toml: a fit takes steps of one size, and the scene has step_control = "
            "\"reversible\"");
  EXPECT_EQ(refused(read(swing(6, 0.4, 0.05) +
                         "[[event]]\ntype = \"lock\"\nat = 0.5\njoint = \"hinge\"\n"),
                    rates, {"coil.stiffness"}),
            "scene.toml: a gradient takes no [[event]]");
  EXPECT_EQ(
      refused(read(swing(6, 0.4, 0.05) +
                   "[[actuator]]\njoint = \"hinge\"\ndevice = \"sea_100\"\n"
                   "theta = { drive = \"rate\", command = { constant = 0.1 } }\n"),
              rates, {"coil.stiffness"}),
      "scene.toml: identify takes no [[actuator]] whose motor moves: the start of its motor has "
      "no slopes; fit porthos.Scene(change=...) with scipy's least_squares");
}

/// A body that is not physical has no log-Cholesky numbers, and the sentence says the way out.
TEST(Identification, RefusesToStartFromAnUnphysicalBody) {
  const Scene s = read_scene(PORTHOS_SOURCE_DIR "/examples/ets_vii/scene.toml");
  const Assembly a = assemble(s);
  try {
    const Unknowns unknowns(s, a, {"link_2"});
    FAIL() << "nothing was refused";
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find("or name some of its numbers, \"link_2.mass\""),
              std::string::npos)
        << e.what();
  }
}

TEST_F(IdentificationOfScenes, Stops) {
  const Scene s = read(swing(6, 0.4, 0.05));
  const std::atomic<bool> stop = true;
  const auto r = identify(s, run_of(s, {"hinge.velocity"}, 1),
                          {.parameters = {"coil.stiffness"}, .stop = &stop});
  EXPECT_EQ(r.failure, "the command was stopped");
  EXPECT_TRUE(r.found.empty());
}

}  // namespace
}  // namespace porthos::scene::identification_test
