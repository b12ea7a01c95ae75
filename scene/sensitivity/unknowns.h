#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "scene/read/variation.h"

namespace porthos::scene {

struct Assembly;

/// A number of a scene that may change: that a log is to tell, or that differences are taken by.
struct Unknown {
  std::string name, unit;
  double start = 0;       ///< of the scene
  double scale = 1;       ///< what counts as a whole change of it, in its unit; more than 0
  bool of_start = false;  ///< a start value
};

/// The numbers of a body, as "<body>.mass", in their order.
inline constexpr const char* inertial_numbers[] = {
    "mass",       "com.x",      "com.y",      "com.z",      "inertia.xx",
    "inertia.xy", "inertia.xz", "inertia.yy", "inertia.yz", "inertia.zz"};

/// The tables of a scene whose numbers may be named.
enum class NumbersOf {
  field,  ///< those that act through the field of the model
  run     ///< all but how it is integrated and judged: controllers, events, orbits too
};

/// The numbers as z, a vector without limits whose entries are of order one. Names:
///
/// "<body>": all ten inertial numbers, by their log-Cholesky numbers, so that every z is physical;
/// "<body>.mass" [kg], with the centre of mass and the inertia about it kept; "<body>.com.x" [m] in
/// the body's frame; "<body>.inertia.xx" [kg m²] about the centre of mass along the body's axes,
/// .xy for both elements; "<element>.<key>", a number of an [[element]], a [[body]], a
/// [[contact]] or an [[actuator]], and with NumbersOf::run of a [[controller]], by its name,
/// "target.linear_velocity[0]"; "<joint>.position", ".velocity", start values; any other number of
/// the scene by its key as in [ensemble], "environment.vector[2]".
///
/// A number whose negative the reader refuses is positive: its z is a logarithm. Others are
/// z · scale.
class Unknowns {
 public:
  /// @param assembly  of the scene
  /// @throws InvalidArgument for a name that is none, twice the same number, a number that the
  ///   scene does not state, a positive one that is 0, a body that is not physical or has no mass
  Unknowns(const Scene& scene, const Assembly& assembly, const std::vector<std::string>& names,
           NumbersOf of = NumbersOf::field);

  /// One for each entry of z.
  const std::vector<Unknown>& list() const { return list_; }
  size_t size() const { return list_.size(); }
  /// z of the scene itself.
  const std::vector<double>& start() const { return start_; }
  /// How number i of the list changes with its z, at the start; of a body's ten, with the number
  /// itself taken alone.
  double by_z(size_t i) const { return logarithmic_[i] ? list_[i].start : list_[i].scale; }
  /// The numbers at z, in the order of list().
  std::vector<double> values(std::span<const double> z) const;
  /// The scene with the numbers at z. Method, step and duration stay.
  /// @throws InvalidArgument where a reader refuses them: an inertia given number by number may be
  ///   unphysical
  Scene at(std::span<const double> z) const;
  /// The text of that scene.
  std::string text(std::span<const double> z) const;
  /// Bodies with numbers in the list.
  size_t bodies() const { return bodies_.size(); }
  /// One of them at z, along its axes.
  mechanics::MassProperties mass(size_t body, std::span<const double> z) const {
    return mass_at(bodies_[body], z);
  }
  /// A scene with another mass of it.
  Scene with_mass(Scene scene, size_t body, const mechanics::MassProperties& mass) const;

 private:
  /// All ten numbers of a body, or some of them.
  struct Body {
    std::string name;
    mechanics::MassProperties start;  ///< along the body's axes
    int whole = -1;                   ///< place in z of ten log-Cholesky numbers; -1: some of them
    std::vector<std::pair<size_t, int>> some = {};  ///< place in z, which of the ten
  };
  struct Key {
    size_t at;  ///< in z
    std::string key;
  };
  bool add_of_body(const std::string& name, const Assembly& assembly);
  bool add_of_joint(const std::string& name, const Assembly& assembly);
  bool add_of_part(const std::string& name, const Assembly& assembly);
  void add_key(const std::string& name, const std::string& key, const Assembly& assembly);
  void add(Unknown unknown, bool positive);
  Body& body(const std::string& name, const mechanics::MassProperties& mass);
  double value(size_t i, double z) const;
  mechanics::MassProperties mass_at(const Body& body, std::span<const double> z) const;
  Scene with_keys(std::span<const Replacement> replacements) const;
  std::vector<Replacement> replacements(std::span<const double> z) const;

  const Scene& scene_;
  NumbersOf of_;
  std::vector<Unknown> list_;
  std::vector<double> start_;
  std::vector<char> logarithmic_;
  std::vector<Body> bodies_;
  std::vector<Key> keys_;
};

}  // namespace porthos::scene
