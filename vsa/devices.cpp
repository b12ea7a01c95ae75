// The catalogue. A number whose source was not read is `recalled` or `illustrative`, and the page
// says so.
#include <cmath>

#include "vsa/catalogue.h"

namespace porthos::vsa {
namespace {

using enum Provenance;

constexpr const char* qbmove_source =
    "github.com/Richi90/ROS-Gazebo-plugin-qbmove, advanced_plugin.cpp";
constexpr const char* maccepa_source =
    "libmaccepa (class), after Van Ham et al. 2007, RAS 55, 761-768";
constexpr const char* edinburgh_source = "libmaccepa, Edinburgh VSA, defines.h";
constexpr const char* userguide =
    "to be verified: Grioli et al. 2015 IJRR 34; Wolf et al. 2016 T-Mech 21; Vanderborght et al. "
    "2013 RAS 61";

Quantity of(const char* name, double value, const char* unit, Provenance p,
            const char* source = "") {
  return {name, {value}, unit, p, source};
}
Quantity table(const char* name, std::vector<double> values, const char* unit, Provenance p,
               const char* source = "") {
  return {name, std::move(values), unit, p, source};
}
Quantity recall(const char* name, std::vector<double> values, const char* unit) {
  return {name, std::move(values), unit, recalled, userguide};
}

/// The stiffnesses of the stops are not published. The values here stop a deflection within a few
/// hundredths of a radian.
void stops(Device& d, double deflection, double stiffness, Provenance of_deflection,
           const char* source) {
  d.limits.deflection = deflection;
  d.limits.stop_stiffness = stiffness;
  d.stops.push_back(of("deflection", deflection, "rad", of_deflection, source));
  d.stops.push_back(of("stop_stiffness", stiffness, "N m/rad^2", illustrative));
}
void range(Device& d, double lower, double upper, const char* unit, Provenance p,
           const char* source = "") {
  d.limits.sigma_lower = lower;
  d.limits.sigma_upper = upper;
  d.stops.push_back(table("sigma", {lower, upper}, unit, p, source));
}

Device qbmove() {
  Device d{.name = "qbmove_advanced", .title = "qbmove Advanced", .family = "cosh"};
  d.parameters = {of("a", 6.7328, "1/rad", published, qbmove_source),
                  of("k", 0.0222, "N m", published, qbmove_source)};
  stops(d, 0.8, 2e3, published, qbmove_source);
  range(d, -0.8, 0.8, "rad", derived, "a spring's limit at zero deflection");
  d.datasheet = {of("link damping", 0.05, "N m s/rad", published, qbmove_source),
                 table("stiffness at zero deflection", {0.298936, 32.64165}, "N m/rad", derived,
                       "sigma 0 and 0.8 rad"),
                 of("energy at the limit", 0.713485, "J", derived, "sigma 0, deflection 0.8 rad"),
                 of("nominal torque", 5.5, "N m", recalled, userguide),
                 of("mass", 0.45, "kg", recalled, userguide)};
  d.remark =
      "The limit is of each spring: |deflection| + |sigma| is at most 0.8 rad. The second spring "
      "of the device "
      "is remembered as a2 = 6.9602 1/rad, k2 = 0.0216 N m and not used.";
  d.sigma = {0, 0.2, 0.4, 0.6};
  d.deflection = 0.6;
  return d;
}

Device qbmove_maker() {
  Device d{.name = "qbmove_maker_pro", .title = "qbmove maker pro", .family = "cosh"};
  d.parameters = {of("a", 9.0, "1/rad", recalled), of("k", 0.0019, "N m", recalled)};
  stops(d, 0.8, 2e3, illustrative, "that of qbmove Advanced");
  range(d, -0.8, 0.8, "rad", illustrative);
  d.sigma = {0, 0.2, 0.4, 0.6};
  d.deflection = 0.6;
  return d;
}

Device maccepa_vd() {
  Device d{.name = "maccepa_vd", .title = "MACCEPA with variable damping", .family = "maccepa"};
  d.parameters = {of("kappa", 323, "N/m", published, "libmaccepa; spring datasheet Z-081K-01I"),
                  of("B", 0.03, "m", published, maccepa_source),
                  of("C", 0.18, "m", published, maccepa_source),
                  of("drum", 0.015, "m", published, maccepa_source)};
  range(d, 0, 3.141592653589793, "rad", published, maccepa_source);
  d.datasheet = {
      of("link inertia", 0.0061, "kg m^2", published, maccepa_source),
      of("link damping", 0.013, "N m s/rad", published, maccepa_source),
      table("damper", {0, 0.107}, "N m s/rad", published, maccepa_source),
      table("theta", {-1.0471975511965976, 1.0471975511965976}, "rad", published, maccepa_source),
      table("servo filter p1, p2, p3", {14000, 1150, 38}, "1/s^3, 1/s^2, 1/s", published,
            maccepa_source)};
  d.remark =
      "The source has other values too: C 0.16 and 0.17 m, drum 0.0075 and 0.01 m, damping 0.00235 "
      "N m s/rad. "
      "At sigma = 0 the stiffness is 0 at zero deflection.";
  d.sigma = {0, 1, 2, 3};
  d.deflection = 1.2;
  return d;
}

Device edinburgh() {
  Device d{.name = "edinburgh", .title = "Edinburgh VSA", .family = "two_spring_servo"};
  d.parameters = {of("kappa", 424, "N/m", published, edinburgh_source),
                  of("s0", 0.02737, "m", published, edinburgh_source),
                  of("h", 0.027, "m", published, edinburgh_source),
                  of("d", 0.081, "m", published, edinburgh_source),
                  of("a", 0.026, "m", published, edinburgh_source),
                  of("L", 0.026, "m", published, edinburgh_source)};
  range(d, 0, 3.141592653589793, "rad", published, edinburgh_source);
  d.datasheet = {
      of("link inertia", 0.0011, "kg m^2", published, edinburgh_source),
      of("link damping", 0.005, "N m s/rad", published, edinburgh_source),
      table("documented stiffness", {-0.066, 0.515}, "N m/rad", published,
            "libmaccepa; these parameters give -0.579 to 0.965, so it is of another calibration")};
  d.remark =
      "theta and sigma are the angles of its two servos; no motor turns the equilibrium alone. The "
      "curves are at theta = 1 rad.";
  d.sigma = {0.5, 1, 1.5, 2};
  d.deflection = 1.1;
  d.theta = 1;
  return d;
}

// NOLINTNEXTLINE(readability-function-size): a table
Device sea() {
  Device d{
      .name = "sea_100", .title = "Series elastic joint, 100 N m/rad", .family = "series_elastic"};
  d.parameters = {of("k", 100, "N m/rad", published, "mex-wholebodymodel, addElasticJoints")};
  d.datasheet = {of("rotor inertia at the joint", 0.548, "kg m^2", published,
                    "mex-wholebodymodel: 5.48e-5 kg m^2 and a gear of 100"),
                 table("joint damping", {5, 10}, "N m s/rad", published, "mex-wholebodymodel")};
  d.sigma = {0};
  d.deflection = 0.3;
  return d;
}

Device hardening() {
  Device d{.name = "hardening_sea",
           .title = "Series elastic actuator that hardens under load",
           .family = "series_elastic"};
  d.parameters = {
      of("k", 50, "N m/rad", illustrative, "HEBI forum, forums.hebi.us: 30-70 at zero load"),
      of("k3", 4000, "N m/rad^3", illustrative, "rising to 300-1000 at full load")};
  d.sigma = {0};
  d.deflection = 0.2;
  return d;
}

Device lever() {
  Device d{.name = "ideal_lever", .title = "Ideal variable lever", .family = "variable_lever"};
  d.parameters = {table("k", {20, 60, 120}, "N m/rad", illustrative)};
  stops(d, 0.4, 2e4, illustrative, "");
  range(d, 0, 1, "1", illustrative);
  d.sigma = {0, 0.3, 0.6, 1};
  d.deflection = 0.45;
  return d;
}

Device quadratic() {
  Device d{.name = "antagonist_quadratic",
           .title = "Antagonistic tendons, quadratic springs",
           .family = "antagonistic_quadratic"};
  d.parameters = {of("ks", 4e5, "N/m^2", illustrative), of("r", 0.02, "m", illustrative)};
  range(d, 0, 1, "rad", illustrative);
  d.remark =
      "A tendon that is slack pulls no more: beyond |deflection| = sigma one spring is left.";
  d.sigma = {0.2, 0.4, 0.6, 0.8};
  d.deflection = 0.9;
  return d;
}

Device exponential() {
  Device d{.name = "antagonist_exponential",
           .title = "Antagonistic exponential springs",
           .family = "antagonistic_exponential"};
  d.parameters = {of("c", 0.2, "N m", illustrative), of("b", 4, "1/rad", illustrative)};
  stops(d, 0.6, 5e3, illustrative, "");
  range(d, 0, 0.8, "rad", illustrative);
  d.sigma = {0, 0.3, 0.6};
  d.deflection = 0.65;
  return d;
}

Device awas() {
  Device d{.name = "awas", .title = "AwAS", .family = "lever_arm"};
  d.parameters = {of("ks", 8e4, "N/m", recalled)};
  stops(d, 0.19, 5e5, recalled, userguide);
  range(d, 0.0137, 0.09, "m", derived,
        "30 to 1300 N m/rad by 2 ks sigma^2, from numbers from memory");
  d.datasheet = {recall("torque", {80}, "N m"), recall("stiffness", {30, 1300}, "N m/rad"),
                 recall("time to change stiffness", {3.5}, "s"), recall("mass", {1.8}, "kg")};
  d.sigma = {0.0137, 0.03, 0.06, 0.09};
  d.deflection = 0.2;
  return d;
}

Device awas2() {
  Device d{.name = "awas_ii", .title = "AwAS-II", .family = "moving_pivot"};
  d.parameters = {of("ks", 2e4, "N/m", illustrative), of("R", 0.1, "m", illustrative),
                  of("L", 0.1, "m", illustrative)};
  stops(d, 0.3, 1e5, recalled, userguide);
  range(d, 0, 0.085, "m", illustrative);
  d.datasheet = {recall("torque", {80}, "N m"),
                 table("stiffness", {0, INFINITY}, "N m/rad", published,
                       "abstract, Jafari et al. 2014 T-Mech 19"),
                 recall("time to change stiffness", {0.8}, "s"), recall("mass", {1.1}, "kg")};
  d.remark = "Generic geometry; the published one is not in reach.";
  d.sigma = {0.02, 0.04, 0.06, 0.07};
  d.deflection = 0.33;
  return d;
}

Device maccepa2() {
  Device d{.name = "maccepa_2", .title = "MACCEPA 2.0", .family = "maccepa_profile"};
  std::vector<double> angle, length;
  for (int i = -32; i <= 32; ++i) {
    const double x = 0.05 * i;
    angle.push_back(x);
    length.push_back(0.03 * (std::sqrt(1 + 2 * x * x) - 1));
  }
  d.parameters = {of("kappa", 2000, "N/m", illustrative), of("drum", 0.015, "m", illustrative),
                  table("angle", angle, "rad", illustrative),
                  table("length", length, "m", illustrative,
                        "0.03 (sqrt(1 + 2 angle^2) - 1), no published profile")};
  range(d, 0, 3.141592653589793, "rad", illustrative);
  d.sigma = {0, 1, 2, 3};
  d.deflection = 1.2;
  return d;
}

std::pair<std::vector<double>, std::vector<double>> cam(double half, double rise, double power) {
  std::pair<std::vector<double>, std::vector<double>> c;
  for (int i = -20; i <= 20; ++i) {
    const double u = 0.05 * i;
    c.first.push_back(half * u);
    c.second.push_back(rise * std::pow(std::fabs(u), power));
  }
  return c;
}

Device fsj() {
  Device d{.name = "dlr_fsj", .title = "DLR FSJ", .family = "floating_spring_cam"};
  const auto [angle, rise] = cam(0.75, 0.0405, 3);
  d.parameters = {of("kappa", 6e4, "N/m", illustrative), of("x0", 0.002, "m", illustrative),
                  table("angle", angle, "rad", illustrative),
                  table("rise", rise, "m", illustrative,
                        "0.012 m |angle / 0.5 rad|^3; the cams are not public")};
  stops(d, 0.26, 1e5, recalled, userguide);
  range(d, 0.05, 0.2, "rad", illustrative);
  d.datasheet = {recall("torque", {67}, "N m"), recall("stiffness", {52.4, 826}, "N m/rad"),
                 recall("energy", {5.3}, "J"), recall("time to change stiffness", {0.33}, "s"),
                 recall("mass", {1.4}, "kg")};
  d.remark = "Family and limits of the device, cams of ours: do not take its curves for the FSJ's.";
  d.sigma = {0.05, 0.1, 0.15, 0.2};
  d.deflection = 0.28;
  return d;
}

Device vs_joint() {
  Device d{.name = "dlr_vs_joint", .title = "DLR VS-Joint", .family = "preload_cam"};
  const auto [angle, rise] = cam(0.5, 0.04, 2);
  d.parameters = {
      of("kappa", 6e4, "N/m", illustrative), table("angle", angle, "rad", illustrative),
      table("rise", rise, "m", illustrative, "0.01 m (angle / 0.25 rad)^2; the cam is not public")};
  stops(d, 0.244, 1e5, recalled, userguide);
  range(d, 0, 0.012, "m", illustrative);
  d.datasheet = {recall("torque", {160}, "N m"), recall("stiffness", {0, 315}, "N m/rad"),
                 recall("energy", {16.8}, "J"), recall("mass", {1.4}, "kg")};
  d.remark = "Family and limits of the device, cam of ours.";
  d.sigma = {0, 0.004, 0.008, 0.012};
  d.deflection = 0.25;
  return d;
}

/// A grid, as from a measurement, computed from the model of the qbmove.
Device measured() {
  Device d{.name = "qbmove_table", .title = "qbmove Advanced as a table", .family = "tabulated"};
  const double a = 6.7328, k = 0.0222;
  std::vector<double> phi, sigma, torque, effort;
  for (int i = -12; i <= 12; ++i) phi.push_back(0.04 * i);
  for (int j = 0; j <= 8; ++j) sigma.push_back(0.05 * j);
  for (const double s : sigma)
    for (const double f : phi) {
      torque.push_back(2 * k * std::cosh(a * s) * std::sinh(a * f));
      effort.push_back(2 * k * std::cosh(a * f) * std::sinh(a * s));
    }
  const char* const source = "the model of qbmove_advanced on 25 x 9 places";
  d.parameters = {table("deflection", phi, "rad", derived, source),
                  table("sigma", sigma, "rad", derived, source),
                  table("torque", torque, "N m", derived, source),
                  table("sigma_effort", effort, "N m", derived, source)};
  range(d, 0, 0.4, "rad", derived, "the table's");
  d.sigma = {0, 0.2, 0.4};
  d.deflection = 0.48;
  return d;
}

Device by_datasheet(const char* name, const char* title, std::vector<Quantity> numbers) {
  Device d{.name = name, .title = title, .family = ""};
  d.datasheet = std::move(numbers);
  return d;
}

}  // namespace

const std::vector<Device>& devices() {
  static const std::vector<Device> all{
      qbmove(),
      qbmove_maker(),
      maccepa_vd(),
      maccepa2(),
      edinburgh(),
      sea(),
      hardening(),
      lever(),
      quadratic(),
      exponential(),
      awas(),
      awas2(),
      fsj(),
      vs_joint(),
      measured(),
      by_datasheet("dlr_qa_joint", "DLR QA-Joint",
                   {recall("torque", {40}, "N m"), recall("stiffness", {20, 750}, "N m/rad"),
                    recall("energy", {2.7}, "J"), recall("deflection", {0.262}, "rad")}),
      by_datasheet("dlr_bavs", "DLR BAVS",
                   {recall("torque", {8}, "N m"), recall("deflection", {0.262}, "rad")}),
      by_datasheet("compact_vsa", "CompAct-VSA",
                   {recall("torque", {117}, "N m"), recall("time to change stiffness", {0.2}, "s"),
                    recall("mass", {2}, "kg")}),
      by_datasheet("vsaut_ii", "vsaUT-II",
                   {recall("torque", {60}, "N m"), recall("stiffness", {0.7, 948}, "N m/rad"),
                    recall("deflection", {0.489}, "rad"), recall("mass", {2.5}, "kg")}),
      by_datasheet("vsa_cube", "VSA-Cube",
                   {recall("torque", {3}, "N m"), recall("stiffness", {3, 14}, "N m/rad"),
                    recall("mass", {0.26}, "kg")}),
  };
  return all;
}

}  // namespace porthos::vsa
