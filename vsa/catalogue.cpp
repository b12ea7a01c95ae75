#include "vsa/catalogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "phs/error.h"
#include "vsa/families.h"
#include "vsa/table.h"

namespace porthos::vsa {
namespace {

double number(const Values& v, const char* key, double otherwise = 0) {
  const auto found = v.find(key);
  return found == v.end() ? otherwise : found->second.at(0);
}
std::vector<double> list(const Values& v, const char* key) {
  const auto found = v.find(key);
  return found == v.end() ? std::vector<double>{} : found->second;
}

// NOLINTNEXTLINE(readability-function-size): a table
std::vector<Family> make_families() {
  return {
      {"series_elastic",
       {{"k", "N m/rad"}, {"k3", "N m/rad^3", false, true}},
       [](const Values& v, const Limits& l) {
         return series_elastic({number(v, "k"), number(v, "k3")}, l);
       }},
      {"variable_lever",
       {{"k", "N m/rad, times powers 0, 1, 2, 3 of sigma", true}},
       [](const Values& v, const Limits& l) {
         const auto k = list(v, "k");
         if (k.empty() || k.size() > 4)
           throw InvalidArgument(
               fmt::format("variable_lever: k has {} entries, expected 1 to 4", k.size()));
         VariableLever p{};
         std::copy(k.begin(), k.end(), p.k.begin());
         return variable_lever(p, l);
       }},
      {"antagonistic_quadratic",
       {{"ks", "N/m^2"}, {"r", "m"}},
       [](const Values& v, const Limits& l) {
         return antagonistic_quadratic({number(v, "ks"), number(v, "r")}, l);
       }},
      {"antagonistic_exponential",
       {{"c", "N m"}, {"b", "1/rad"}},
       [](const Values& v, const Limits& l) {
         return antagonistic_exponential({number(v, "c"), number(v, "b")}, l);
       }},
      {"cosh",
       {{"a", "1/rad"}, {"k", "N m"}, {"a2", "1/rad", false, true}, {"k2", "N m", false, true}},
       [](const Values& v, const Limits& l) {
         return cosh_springs({number(v, "a"), number(v, "k"), number(v, "a2"), number(v, "k2")}, l);
       }},
      {"lever_arm",
       {{"ks", "N/m"}},
       [](const Values& v, const Limits& l) { return lever_arm({number(v, "ks")}, l); }},
      {"moving_pivot",
       {{"ks", "N/m"}, {"R", "m"}, {"L", "m"}},
       [](const Values& v, const Limits& l) {
         return moving_pivot({number(v, "ks"), number(v, "R"), number(v, "L")}, l);
       }},
      {"maccepa",
       {{"kappa", "N/m"}, {"B", "m"}, {"C", "m"}, {"drum", "m"}},
       [](const Values& v, const Limits& l) {
         return maccepa({number(v, "kappa"), number(v, "B"), number(v, "C"), number(v, "drum")}, l);
       }},
      {"maccepa_profile",
       {{"kappa", "N/m"}, {"drum", "m"}, {"angle", "rad", true}, {"length", "m", true}},
       [](const Values& v, const Limits& l) {
         return maccepa_profile(
             {number(v, "kappa"), number(v, "drum"), list(v, "angle"), list(v, "length")}, l);
       }},
      {"floating_spring_cam",
       {{"kappa", "N/m"}, {"x0", "m", false, true}, {"angle", "rad", true}, {"rise", "m", true}},
       [](const Values& v, const Limits& l) {
         return floating_spring_cam(
             {number(v, "kappa"), number(v, "x0"), list(v, "angle"), list(v, "rise")}, l);
       }},
      {"preload_cam",
       {{"kappa", "N/m"}, {"angle", "rad", true}, {"rise", "m", true}},
       [](const Values& v, const Limits& l) {
         return preload_cam({number(v, "kappa"), list(v, "angle"), list(v, "rise")}, l);
       }},
      {"two_spring_servo",
       {{"kappa", "N/m"}, {"s0", "m"}, {"h", "m"}, {"d", "m"}, {"a", "m"}, {"L", "m"}},
       [](const Values& v, const Limits& l) {
         return two_spring_servo({number(v, "kappa"), number(v, "s0"), number(v, "h"),
                                  number(v, "d"), number(v, "a"), number(v, "L")},
                                 l);
       }},
      {"tabulated",
       {{"deflection", "rad", true},
        {"sigma", "unit of sigma", true},
        {"torque", "N m", true},
        {"stiffness", "N m/rad", true, true},
        {"sigma_effort", "J per unit of sigma", true, true},
        {"tolerance", "1", false, true},
        {"smoothing", "N m", false, true},
        {"relative_smoothing", "1", false, true}},
       [](const Values& v, const Limits& l) {
         return tabulated({list(v, "deflection"), list(v, "sigma"), list(v, "torque"),
                           list(v, "stiffness"), list(v, "sigma_effort")},
                          l, number(v, "tolerance", 0.02),
                          {number(v, "smoothing"), number(v, "relative_smoothing")});
       }},
  };
}

}  // namespace

const std::vector<Family>& families() {
  static const std::vector<Family> all = make_families();
  return all;
}

ElasticPtr make_elastic(const std::string& family, const Values& values, const Limits& l) {
  const Family& f = find_named(families(), family, "unknown family");
  const std::string known = listed(f.keys, [](const auto& k) { return k.name; });
  for (const auto& [name, value] : values) {
    const auto k = std::find_if(f.keys.begin(), f.keys.end(),
                                [&, n = name](const auto& x) { return x.name == n; });
    if (k == f.keys.end())
      throw InvalidArgument(
          fmt::format("{}: unknown parameter '{}', expected {}", family, name, known));
    if (!k->list && value.size() != 1)
      throw InvalidArgument(
          fmt::format("{}: {} has {} entries, expected one number", family, name, value.size()));
  }
  for (const auto& k : f.keys)
    if (!k.optional && !values.contains(k.name))
      throw InvalidArgument(
          fmt::format("{}: no parameter '{}' [{}], expected {}", family, k.name, k.unit, known));
  return f.make(values, l);
}

const char* to_string(Provenance p) {
  switch (p) {
    case Provenance::published:
      return "published";
    case Provenance::derived:
      return "derived";
    case Provenance::recalled:
      return "from memory, unverified";
    case Provenance::illustrative:
      return "chosen here";
  }
  return "?";
}

const Device& device(const std::string& name) {
  return find_named(devices(), name, "unknown device");
}

ElasticPtr elastic_of(const Device& d) {
  if (d.family.empty())
    throw InvalidArgument(
        fmt::format("device '{}' has no model: its parameters are not public, expected a device "
                    "with a family, or a family with "
                    "parameters of yours",
                    d.name));
  Values v;
  for (const auto& p : d.parameters) v[p.name] = p.value;
  return make_elastic(d.family, v, d.limits);
}

}  // namespace porthos::vsa
