#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "vsa/elastic.h"

/// The families by name with their parameters, and a catalogue of devices that states the source of
/// every number.
namespace porthos::vsa {

/// Parameters by name. A number is a list of length one.
using Values = std::map<std::string, std::vector<double>>;

/// A parameter of a family.
struct Key {
  std::string name, unit;
  bool list = false;  ///< a table's column, or coefficients
  bool optional = false;
};
/// A family of elastic energies: its parameters and its maker.
struct Family {
  std::string name;
  std::vector<Key> keys;
  std::function<ElasticPtr(const Values&, const Limits&)> make;
};
/// All of them.
const std::vector<Family>& families();
/// A member of a family.
/// @throws InvalidArgument for an unknown family or parameter (lists the known ones), a missing
/// one, a list where a number is expected, or a number that the family refuses
ElasticPtr make_elastic(const std::string& family, const Values& values, const Limits& l);

/// The origin of a number.
enum class Provenance {
  published,     ///< read in the named source
  derived,       ///< computed from published numbers by the model
  recalled,      ///< from memory of the literature, not verified: do not rely on it
  illustrative,  ///< chosen here, to have an example to run
};
const char* to_string(Provenance p);

/// A number with its unit and origin.
struct Quantity {
  std::string name;
  std::vector<double> value;
  std::string unit;
  Provenance provenance = Provenance::illustrative;
  std::string source = {};
};

/// An existing device, with the numbers that are known.
struct Device {
  std::string name, title;
  std::string family = {};                ///< empty: no model; its parameters are not public
  std::vector<Quantity> parameters = {};  ///< of the family
  std::vector<Quantity> datasheet = {};  ///< published data of the device; not used in computations
  Limits limits = {};
  std::vector<Quantity> stops = {};  ///< the limits above, with their provenance
  std::string remark = {};
  std::vector<double> sigma = {};  ///< for the plot of its datasheet, and for tests
  double deflection = 0;           ///< for the same, ± [rad]
  double theta = 0;                ///< origin of φ in an energy that is not translation invariant
};
/// All of them.
const std::vector<Device>& devices();
/// @throws InvalidArgument for an unknown name, which lists the known ones
const Device& device(const std::string& name);
/// @throws InvalidArgument for a device without a model
ElasticPtr elastic_of(const Device& d);

}  // namespace porthos::vsa
